import { isSilent } from "../../iveg/static/js/core/clock.js";
import { createLabels } from "../../iveg/static/js/map/layers/labels.js";
import { accessSaid } from "../../iveg/static/js/panels/access.js";
import { detectorSaid } from "../../iveg/static/js/panels/detector.js";
import { createGauge, readingOf } from "../../iveg/static/js/panels/gauge.js";
import {
  certaintySaid,
  gaugeSaid,
  marginPartsSaid,
  marginSaid,
  readoutsSaid,
  taskSaid,
} from "../../iveg/static/js/panels/robot_texts.js";
import { detection } from "./builders.js";
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

test("13.8 the gauge draws the factor of the robot's situation", () => {
  equal(readingOf(robot()).factor, 1);
  equal(readingOf(robot({ situation: { factor: 0 } })).factor, 0);
  equal(readingOf(robot({ situation: { factor: null } })).factor, null);
});

test("a robot that stands is not said to be too close to stop in time", () => {
  const parts = { person_walks_m: 1.3 };
  const margin = { margin_m: -0.4, gap_m: 1.2, band: "inside", person_id: "P1", parts };
  const still = { linear: 0, angular: 0 };
  const drives = robot({ margin });
  const stands = robot({ margin, twist: still });
  equal(marginSaid(drives, words), "robot.margin_value -0.4 robot.margin_band.inside");
  equal(marginSaid(stands, words).split(" ")[0], "robot.margin_stands");
  equal(marginPartsSaid(drives, words).split(" ")[0], "robot.margin_parts");
  equal(marginPartsSaid(stands, words).split(" ")[0], "robot.margin_parts_stands");
  equal(marginPartsSaid(robot({ margin: null }), words), "");
});

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

test("a robot that is lost has no margin", () => {
  const margin = { margin_m: 1.2, band: "clear", person_id: "P1" };
  const lost = robot({ age_s: 9, margin });
  equal(marginSaid(lost, words), "robot.margin_lost");
  const restored = robot({ age_s: null, margin });
  equal(marginSaid(restored, words), "robot.margin_lost");
});

test("13.5 a robot that was never heard has no speed and no limit", () => {
  const silent = robot({ pose: null, twist: null, situation: { factor: null } });
  equal(readingOf(silent), { speed: null, max: 2, factor: null });
  equal(readingOf(undefined), { speed: null, max: 1, factor: null });
});

test("13.16 no task is never the word none", () => {
  equal(taskSaid("none", words), "task.unknown");
  equal(taskSaid(null, words), "task.unknown");
  equal(taskSaid("hauling", words), "task.hauling");
  equal(taskSaid("mulching", words), "mulching");
});

test("13.19 what is forbidden ends where what is filled could be", () => {
  const gauge = createGauge();
  const said = { name: "AGI", said: "0.4", limitSaid: "limit", speedSaid: "0.4" };
  gauge.draw({ speed: 0.4, max: 1, factor: 0.5, ...said });
  for (const svg of [gauge.svg, gauge.bar]) {
    const path = (/** @type {string} */ name) =>
      svg.querySelector(`.gauge__${name}`)?.getAttribute("d");
    equal(path("track") === path("beyond"), false);
    equal(svg.getAttribute("aria-valuetext"), "0.4");
  }
  gauge.draw({ speed: null, max: 1, factor: null, ...said });
  equal(gauge.svg.querySelector(".gauge__limit")?.getAttribute("visibility"), "hidden");
});

test("a read-out without a value is a dash, a zero is a zero", () => {
  const still = robot({ pose: { x: 0, y: 1, yaw: Math.PI / 2 }, twist: null });
  equal(readoutsSaid(still, words), [
    ["x", "0.00 robot.unit.m"],
    ["y", "1.00 robot.unit.m"],
    ["yaw", "90.0 robot.unit.deg"],
    ["v", "—"],
    ["w", "—"],
  ]);
});

test("a gauge says no limit and no speed of a robot without a message", () => {
  const { said, limitSaid, speedSaid } = gaugeSaid(undefined, "AGI", words);
  equal([said, limitSaid, speedSaid], ["robot.speed_unknown", "", "—"]);
  equal(gaugeSaid(robot(), "AGI", words).said, "robot.gauge_value 0.5 2 2");
});

test("the most certain detection of a fresh frame is told, an old frame says nothing", () => {
  const items = [0.3, 0.9, 0.6].map((probability) => detection({ probability }));
  const way = { transport: "direct" };
  const frame = { robot_id: "AGI", stamp: "s", age_s: 0, ...way, items };
  const fresh = { ...frame, receivedAtMs: performance.now() };
  const old = { ...frame, receivedAtMs: performance.now() - 3500 };
  equal(certaintySaid(fresh, words), "robot.certainty_value person 0.9");
  equal(certaintySaid({ ...fresh, items: [] }, words), "robot.certainty_none");
  equal(certaintySaid(old, words), "robot.certainty_old");
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

test("a robot is heard, or revoked as one that stood or that may move", () => {
  const since = "2026-05-01T10:00:00.000Z";
  const said = (/** @type {boolean} */ stood) =>
    accessSaid(robot({ revoked: { by: "Ana", since, stood } }), words);
  equal(accessSaid(robot(), words), "access.state.heard");
  equal(accessSaid(undefined, words), "access.state.heard");
  equal(said(true).split(" ")[0], "access.state.stood");
  equal(said(false).split(" ")[0], "access.state.unconfirmed");
});

test("a camera is read, not read, out of service or not there", () => {
  const said = (/** @type {object} */ detector) =>
    detectorSaid(robot({ detector }), words);
  const out = { out_by: null, out_since: null };
  equal(said({ required: true, missing: false, ...out }), "detector.state.works");
  equal(said({ required: true, missing: true, ...out }), "detector.state.missing");
  equal(said({ required: false, missing: true, ...out }), "detector.state.none");
  equal(detectorSaid(undefined, words), "");
});
