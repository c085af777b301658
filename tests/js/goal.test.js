import { goalSaid, whyNotGoal, wishOf } from "../../iveg/static/js/panels/goal.js";
import { command, robot } from "./builders.js";
import { equal, test } from "./harness.js";

/** @typedef {import("../../iveg/static/js/panels/release.js").Facts} Facts */
/** @typedef {import("../../iveg/static/js/core/protocol.js").Robot} Robot */
/** @typedef {NonNullable<Robot["goal"]>} Goal */

/** A robot that is free to drive. @param {Partial<Facts>} [changes] */
function facts(changes = {}) {
  return {
    connection: /** @type {const} */ ("open"),
    role: "operator",
    ageS: 0.1,
    robot: robot(),
    command: undefined,
    ...changes,
  };
}

/** The key of what is said of a goal. @param {Partial<Goal>} changes */
function said(changes) {
  const at = "2026-01-01T00:00:00.000Z";
  const goal = /** @type {Goal} */ ({
    ...{ goal_id: "01G", robot_id: "AGI", kind: "here", x: 1, y: 2, aisle: null },
    ...{ by: "ana", state: "SENT", why: null, sent_at: at },
    ...{ answered_at: null, ended_at: null, forgotten_at: null },
    ...changes,
  });
  const i18n = /** @type {any} */ ({ t: (/** @type {string} */ key) => key });
  return goalSaid(robot({ goal }), i18n);
}

test("each button of the menu asks for what it says", () => {
  equal(wishOf("aisle", "Pasillo 3"), { kind: "aisle", aisle: "Pasillo 3" });
  equal(wishOf("return", "Pasillo 3"), { kind: "return" });
  equal(wishOf("pause", "Pasillo 3"), { kind: "pause" });
  equal(wishOf("cancel", "Pasillo 3"), null);
});

test("a free robot of an operator may be sent", () => {
  equal(whyNotGoal(facts()), "ok");
  equal(whyNotGoal(facts({ role: "viewer" })), "role");
  equal(whyNotGoal(facts({ ageS: 3 })), "not_fresh");
});

test("a robot that is held, stopped or played is not sent", () => {
  const held = robot({ holds: [{ id: "h", source: "hw", ack: "local" }] });
  equal(whyNotGoal(facts({ robot: held })), "held");
  const stopped = command({ kind: "stop", state: "READY" });
  equal(whyNotGoal(facts({ command: stopped })), "held");
  equal(whyNotGoal(facts({ robot: robot({ replay: true }) })), "recording");
  equal(whyNotGoal(facts({ robot: undefined })), "not_fresh");
});

test("a deleted goal is forgotten once the robot itself says so", () => {
  equal(said({ state: "DELETED" }), "goal.state.DELETED");
  const forgotten_at = "2026-01-01T00:00:01.000Z";
  equal(said({ state: "DELETED", forgotten_at }), "goal.state.FORGOTTEN");
  equal(said({ state: "CANCELLED", forgotten_at }), "goal.state.CANCELLED");
});
