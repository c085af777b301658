import {
  doubtOf,
  viewOfFleet,
  viewOfRobot,
} from "../../iveg/static/js/panels/stop_view.js";
import { command } from "./builders.js";
import { equal, test } from "./harness.js";

/** @typedef {import("../../iveg/static/js/panels/stop_view.js").RobotFacts} RobotFacts */
/** @typedef {import("../../iveg/static/js/panels/press.js").Pending} Pending */

/** @param {Partial<RobotFacts>} [changes] @returns {RobotFacts} */
function facts(changes = {}) {
  return {
    robotId: "AGI",
    connection: "open",
    link: "LIVE",
    ageS: 0.1,
    command: null,
    press: null,
    nowMs: 10_000,
    serverNowS: 1000,
    ...changes,
  };
}

/** @param {Partial<Pending>} [changes] @returns {Pending} */
function pressed(changes = {}) {
  const press = { robotId: "AGI", pressId: "p", atMs: 9_820, tries: 1 };
  return { ...press, accepted: false, ...changes };
}

/** @param {Partial<RobotFacts>} changes */
const stateOf = (changes) => viewOfRobot(facts(changes)).state;

/** @param {string} state */
const inState = (state) => stateOf({ command: command({ kind: "stop", state }) });

test("a fresh robot that nobody stopped can be stopped", () => {
  equal(viewOfRobot(facts()), {
    state: "ready",
    key: "stop.ready",
    slots: { robot: "AGI" },
  });
});

test("a late robot's control says how late", () => {
  const view = viewOfRobot(facts({ link: "LATE", ageS: 2.2 }));
  equal(view, {
    state: "late",
    key: "stop.late",
    slots: { robot: "AGI", seconds: 2.2 },
  });
});

test("without a link to robot or server a control does not look as if it worked", () => {
  equal(stateOf({ link: "LOST", ageS: 9 }), "lost");
  equal(stateOf({ link: "UNKNOWN", ageS: Number.POSITIVE_INFINITY }), "lost");
  equal(stateOf({ connection: "lost" }), "lost");
  equal(stateOf({ connection: "signed-out" }), "lost");
});

test("f42 a session that is over says so and still looks as if it stops", () => {
  const over = { connection: /** @type {const} */ ("signed-out"), isBlind: true };
  equal(viewOfRobot(facts(over)), {
    state: "late",
    key: "stop.blind",
    slots: { robot: "AGI" },
  });
  const taken = viewOfRobot(facts({ ...over, press: pressed({ accepted: true }) }));
  equal(taken.key, "stop.blind_taken");
});

test("a press that the server does not take from an ended session is not believed", () => {
  const over = { connection: /** @type {const} */ ("signed-out"), isBlind: true };
  equal(stateOf({ ...over, press: pressed({ atMs: 9_000 }) }), "lost");
});

test("what is not known of a silent robot grows while nobody hears of it", () => {
  const silent = command({
    robot: { v: -0.5, report_age_s: 2, moved_m: 1 },
    receivedAtMs: 7_000,
  });
  equal(doubtOf(silent, 10_000), { ageS: 5, movedM: 2.5 });
  equal(doubtOf(command({ robot: null }), 10_000), null);
});

test("a standstill of before the server was lost is not shown as one of now", () => {
  const standing = command({ kind: "stop", state: "STANDING", standstill_ms: 412 });
  equal(stateOf({ connection: "lost", command: standing }), "lost");
});

test("every step of a STOP has its own look", () => {
  const steps = [
    ["REQUESTED", "asked"],
    ["SENT", "asked"],
    ["DELIVERED", "acknowledged"],
    ["STANDING", "standing"],
    ["UNCONFIRMED", "unconfirmed"],
    ["STILL_MOVING", "still_moving"],
    ["STALE", "stale"],
    ["RELEASING", "releasing"],
    ["READY", "rearmed"],
    ["RUNNING", "ready"],
  ];
  for (const [state, shown] of steps) equal(inState(state), shown);
});

test("a robot that moved while held is told apart from one that was asked to stop", () => {
  const again = command({ kind: "stop", state: "SENT", reason: "moved" });
  equal(stateOf({ command: again }), "moved");
  const braking = command({ kind: "stop", state: "DELIVERED", reason: "moved" });
  equal(stateOf({ command: braking }), "moved");
  const standing = command({ kind: "stop", state: "STANDING", reason: "moved" });
  equal(stateOf({ command: standing }), "standing");
});

test("a standstill says how long it took, when that is known", () => {
  const timed = command({ kind: "stop", state: "STANDING", standstill_ms: 412 });
  const adopted = command({ kind: "stop", state: "STANDING", standstill_ms: null });
  equal(viewOfRobot(facts({ command: timed })).slots, { ms: 412 });
  equal(viewOfRobot(facts({ command: adopted })).key, "stop.standing_untimed");
});

test("the milliseconds of a press count from the finger", () => {
  equal(viewOfRobot(facts({ press: pressed() })), {
    state: "asked",
    key: "stop.asked",
    slots: { ms: 180 },
  });
});

test("a press that the server did not take in half a second says so", () => {
  const late = pressed({ atMs: 9_000, tries: 2 });
  equal(viewOfRobot(facts({ press: late })).key, "stop.not_taken");
  equal(stateOf({ press: pressed({ atMs: 9_000, accepted: true }) }), "asked");
});

test("a press on a dead line is seen, and then the dead line again", () => {
  equal(stateOf({ connection: "lost", press: pressed() }), "asked");
  equal(stateOf({ connection: "lost", press: pressed({ atMs: 1_000 }) }), "lost");
});

test("a new press never hides that the last STOP is unconfirmed", () => {
  const open = command({ kind: "stop", state: "UNCONFIRMED" });
  equal(stateOf({ command: open, press: pressed() }), "unconfirmed");
});

test("what a robot did last seconds ago counts on while nothing is heard", () => {
  const stale = command({
    kind: "stop",
    state: "STALE",
    robot: { v: 0, report_age_s: 2, moved_m: 0 },
  });
  stale.receivedAtMs = 0;
  equal(viewOfRobot(facts({ command: stale })).slots, { seconds: 12 });
});

/** @param {...Partial<RobotFacts>} robots */
function fleetOf(...robots) {
  const views = robots.map((changes) => {
    const known = facts(changes);
    return { view: viewOfRobot(known), link: known.link, ageS: known.ageS };
  });
  const shared = { connection: facts().connection, press: null, nowMs: 10_000 };
  return viewOfFleet({ ...shared, robots: views });
}

const standing = { command: command({ kind: "stop", state: "STANDING" }) };
const unconfirmed = { command: command({ kind: "stop", state: "UNCONFIRMED" }) };

test("the fleet stands only when every robot stands", () => {
  equal(fleetOf(standing, standing).key, "stop.standing_fleet");
  equal(fleetOf(standing, {}).state, "ready");
  equal(fleetOf(standing, unconfirmed).state, "unconfirmed");
});

test("the fleet can be stopped while one robot still runs", () => {
  equal(fleetOf(unconfirmed, {}).state, "ready");
});

test("the fleet's control is dead only when nobody can be reached", () => {
  equal(fleetOf({ link: "LOST" }, { link: "LOST" }).state, "lost");
  equal(fleetOf({ link: "LOST" }, {}).state, "ready");
});
