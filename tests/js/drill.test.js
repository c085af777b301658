import { progressOf, whyNotDrill } from "../../iveg/static/js/panels/drill.js";
import { command, robot } from "./builders.js";
import { equal, test } from "./harness.js";

/** @typedef {import("../../iveg/static/js/panels/release.js").Facts} Facts */

/** A robot that stands and that nobody stops. @param {Partial<Facts>} [changes] */
function facts(changes = {}) {
  return {
    connection: /** @type {const} */ ("open"),
    role: "operator",
    ageS: 0.1,
    robot: robot({ twist: { linear: 0.2, angular: 0 } }),
    command: undefined,
    ...changes,
  };
}

/** @param {string} state @param {number | null} ms @param {number} ageMs */
const progress = (state, ms, ageMs) =>
  progressOf(command({ kind: "stop", state, standstill_ms: ms }), ageMs);

test("a robot that stands or creeps can be drilled, also backwards", () => {
  equal(whyNotDrill(facts()), "ok");
  const back = robot({ twist: { linear: -0.15, angular: 0 } });
  equal(whyNotDrill(facts({ robot: back })), "ok");
});

test("a robot that drives, or of which nothing is known, is not drilled", () => {
  const fast = robot({ twist: { linear: -0.21, angular: 0 } });
  equal(whyNotDrill(facts({ robot: fast })), "moving");
  equal(whyNotDrill(facts({ robot: robot({ twist: null }) })), "moving");
  equal(whyNotDrill(facts({ ageS: 1.2 })), "not_fresh");
});

test("a viewer drills nothing, and nobody does without a server", () => {
  equal(whyNotDrill(facts({ role: "viewer" })), "role");
  equal(whyNotDrill(facts({ connection: "lost" })), "no_link");
});

test("a robot that is stopped already proves nothing", () => {
  const standing = command({ kind: "stop", state: "STANDING" });
  equal(whyNotDrill(facts({ command: standing })), "stopped");
});

test("a drill has passed when the robot stands within five seconds of the press", () => {
  equal(progress("STANDING", 5000, 6000), "drill.passed");
  equal(progress("STANDING", 5000.1, 6200), "drill.slow");
});

test("a drill that is not over is not judged", () => {
  equal(progress("DELIVERED", null, 800), "drill.running");
  equal(progress("UNCONFIRMED", null, 4900), "drill.running");
  equal(progress("UNCONFIRMED", null, 5100), "drill.failed");
  equal(progress("STILL_MOVING", null, 5100), "drill.failed");
});
