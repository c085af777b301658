import { isSilent } from "../../iveg/static/js/core/clock.js";
import { createLabels } from "../../iveg/static/js/map/layers/labels.js";
import { readingOf } from "../../iveg/static/js/panels/gauge.js";
import { marginSaid } from "../../iveg/static/js/panels/robot_texts.js";
import { equal, test } from "./harness.js";

const words = /** @type {import("../../iveg/static/js/core/i18n.js").I18n} */ (
  /** @type {unknown} */ ({
    t: (/** @type {string} */ key, /** @type {object} */ slots = {}) =>
      [key, ...Object.values(slots)].join(" "),
    has: (/** @type {string} */ key) => key === "task.hauling",
    number: (/** @type {number} */ value, /** @type {number} */ decimals) =>
      value.toFixed(decimals),
  })
);

/** A robot that drives on a clear way. @param {object} [differs] */
function robot(differs = {}) {
  return /** @type {import("../../iveg/static/js/core/protocol.js").Robot} */ (
    /** @type {unknown} */ ({
      robot_id: "AGI",
      mode: "RUNNING",
      pose: { x: 1, y: 1, yaw: 0 },
      twist: { linear: 0.5, angular: 0 },
      situation: { factor: 1 },
      profile: { max_speed: 2 },
      ...differs,
    })
  );
}

test("13.8 a margin that nobody knows has no number", () => {
  const margin = /** @type {import("../../iveg/static/js/core/protocol.js").Margin} */ (
    /** @type {unknown} */ ({ margin_m: -20.2, band: "unknown", person_id: "P1" })
  );
  equal(marginSaid(robot({ margin }), words), "robot.margin_band.unknown");
  equal(marginSaid(robot(), words), "robot.margin_nobody");
  const known = { ...margin, margin_m: 1.2, band: /** @type {const} */ ("clear") };
  const near = robot({ margin: known });
  equal(marginSaid(near, words), "robot.margin_value 1.2 robot.margin_band.clear");
});

test("13.5 a robot that was never heard has no speed and no limit", () => {
  const silent = robot({ pose: null, twist: null, situation: { factor: null } });
  equal(readingOf(silent), { speed: null, max: 2, factor: null });
  equal(readingOf(undefined), { speed: null, max: 1, factor: null });
});

test("what a restart restored has an age that nobody knows, and says so on the map", () => {
  const links = /** @type {const} */ (["LIVE", "LATE", "LOST", "UNKNOWN"]);
  equal(
    links.map((link) => isSilent(link)),
    [false, false, true, true],
  );
  const labels = createLabels(words.t, "en");
  equal(
    [labels.ago(12.4), labels.ago(Number.POSITIVE_INFINITY)],
    ["map.ghost 12", "? s"],
  );
});
