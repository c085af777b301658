import { isSilent } from "../../iveg/static/js/core/clock.js";
import { createLabels } from "../../iveg/static/js/map/layers/labels.js";
import { detectorSaid } from "../../iveg/static/js/panels/detector.js";
import { createGauge, readingOf } from "../../iveg/static/js/panels/gauge.js";
import {
  certaintySaid,
  gaugeSaid,
  marginSaid,
  modeSaid,
  readoutsSaid,
  taskSaid,
  whySaid,
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
      speed_factor: 1,
      applied: { reason: "clear", faults: [] },
      speed_limit: { speed_factor: 1, reason: "clear", distance_m: null },
      holds: [],
      stop: null,
      profile: { max_speed: 2 },
      ...differs,
    })
  );
}

test("13.8 the gauge draws the stricter of what was ordered and what is applied", () => {
  const ordered = { speed_limit: { speed_factor: 0.5, reason: "person" } };
  equal(readingOf(robot()).factor, 1);
  equal(readingOf(robot(ordered)).factor, 0.5);
  equal(readingOf(robot({ speed_factor: 0 })).factor, 0);
  equal(readingOf(robot({ ...ordered, speed_factor: 0 })).factor, 0);
});

test("13.8 a robot at 0.00 m/s is waiting, and its way is not said to be clear", () => {
  const waiting = robot({ twist: { linear: 0.002, angular: 0 } });
  equal(modeSaid(waiting, words), "robot.mode.WAITING");
  equal(whySaid(waiting, words), "");
  equal(modeSaid(robot(), words), "robot.mode.RUNNING");
  equal(whySaid(robot(), words), "robot.why.clear ");
  const turning = robot({ twist: { linear: 0, angular: 0.3 } });
  equal(modeSaid(turning, words), "robot.mode.RUNNING");
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

test("a robot that is lost has no margin, and its way is not said to be clear", () => {
  const margin = { margin_m: 1.2, band: "clear", person_id: "P1" };
  const lost = robot({ age_s: 9, margin });
  equal(marginSaid(lost, words), "robot.margin_lost");
  equal(whySaid(lost, words), "");
  const restored = robot({ age_s: null, margin });
  equal(marginSaid(restored, words), "robot.margin_lost");
  equal(whySaid(restored, words), "");
  const limited = { speed_factor: 0.5, reason: "stale", distance_m: null };
  equal(whySaid(robot({ age_s: 9, speed_limit: limited }), words), "robot.why.stale ");
});

test("13.5 a robot that was never heard has no speed, no limit and no reason", () => {
  const silent = robot({ pose: null, twist: null, applied: null, speed_factor: null });
  equal(readingOf(silent), { speed: null, max: 2, factor: null });
  equal(readingOf(undefined), { speed: null, max: 1, factor: null });
  equal(modeSaid(silent, words), "robot.mode.UNKNOWN");
  equal(whySaid(silent, words), "");
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

/** @param {string} premise @param {string} robot_id @param {string} reason */
function lacking(premise, robot_id, reason) {
  return robot({
    speed_limit: { speed_factor: 0.5, reason, cause: robot_id, distance_m: null },
    missing: [{ premise, robot_id }],
  });
}

test("a robot says what it lacks to be clear, and whose it is", () => {
  equal(whySaid(lacking("pose", "AGI", "stale"), words), "robot.missing.pose AGI");
  equal(
    whySaid(lacking("detector", "AGI", "stale"), words),
    "robot.missing.detector_own AGI",
  );
  equal(
    whySaid(lacking("detector", "AGII", "stale"), words),
    "robot.missing.detector AGII",
  );
  equal(whySaid(lacking("doubt", "AGII", "doubt"), words), "robot.missing.doubt AGII");
});

test("near a person that is the reason, whatever else is missing", () => {
  const near = robot({
    speed_limit: { speed_factor: 0.5, reason: "person", distance_m: 1.4 },
    missing: [{ premise: "detector", robot_id: "AGII" }],
  });
  equal(whySaid(near, words), "robot.why.person 1.4");
});

test("a person whose zone lies ahead is said with the seconds until it", () => {
  const ahead = robot({
    speed_limit: {
      ...{ speed_factor: 0.5, reason: "person", distance_m: 3.1 },
      foretold_s: 1.2,
    },
  });
  equal(whySaid(ahead, words), "robot.why.person_ahead 3.1 1.2");
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
