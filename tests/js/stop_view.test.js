import { linkOf } from "../../iveg/static/js/core/clock.js";
import { LIMITS } from "../../iveg/static/js/core/limits.js";
import {
  doubtOf,
  viewOfFleet,
  viewOfRobot,
} from "../../iveg/static/js/panels/stop_view.js";
import { command } from "./builders.js";
import { equal, test } from "./harness.js";

/** @typedef {import("../../iveg/static/js/panels/stop_view.js").RobotFacts} RobotFacts */
/** @typedef {import("../../iveg/static/js/panels/press.js").Pending} Pending */

/** A robot that has just said that it stands. */
const RESTS = { v: 0, report_age_s: 0.1, moved_m: 0 };

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
const inState = (state) =>
  stateOf({ command: command({ kind: "stop", state, robot: RESTS }) });

test("I12 a late robot's control says how late", () => {
  const view = viewOfRobot(facts({ link: "LATE", ageS: 2.2 }));
  equal(view, {
    state: "late",
    key: "stop.late",
    slots: { robot: "AGI", seconds: 2.2 },
  });
});

test("I12 without a link to robot or server a control does not look as if it worked", () => {
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

test("I12 a standstill of before the server was lost is not shown as one of now", () => {
  const standing = command({
    kind: "stop",
    state: "STANDING",
    robot: RESTS,
    standstill_ms: 412,
  });
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
  const standing = command({
    kind: "stop",
    state: "STANDING",
    robot: RESTS,
    reason: "moved",
  });
  equal(stateOf({ command: standing }), "standing");
});

test("13.12 a press on a dead line is kept, says since when, and looks like no STOP", () => {
  for (const [atMs, seconds] of [
    [9_900, 0.1],
    [2_000, 8],
  ]) {
    const view = viewOfRobot(facts({ connection: "lost", press: pressed({ atMs }) }));
    equal(view, { state: "lost", key: "stop.kept", slots: { seconds } });
    const fleet = {
      connection: /** @type {const} */ ("lost"),
      nowMs: 10_000,
      robots: [],
    };
    equal(viewOfFleet({ ...fleet, press: pressed({ atMs }) }).key, "stop.kept");
  }
  equal(viewOfRobot(facts({ connection: "lost" })).key, "stop.lost");
});

test("a new press never hides that the last STOP is unconfirmed", () => {
  const open = command({ kind: "stop", state: "UNCONFIRMED" });
  equal(stateOf({ command: open, press: pressed() }), "unconfirmed");
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

const standing = {
  command: command({ kind: "stop", state: "STANDING", robot: RESTS }),
};
const unconfirmed = { command: command({ kind: "stop", state: "UNCONFIRMED" }) };

test("the fleet stands only when every robot stands", () => {
  equal(fleetOf(standing, standing).key, "stop.standing_fleet");
  equal(fleetOf(standing, {}).state, "ready");
  equal(fleetOf(standing, unconfirmed).state, "unconfirmed");
});

test("the fleet's control is dead only when nobody can be reached", () => {
  equal(fleetOf({ link: "LOST" }, { link: "LOST" }).state, "lost");
  equal(fleetOf({ link: "LOST" }, {}).state, "late");
});

test("the fleet's control says how many robots a press does not reach", () => {
  const never = { link: /** @type {const} */ ("UNKNOWN"), ageS: Infinity };
  const late = { link: /** @type {const} */ ("LATE"), ageS: 2.2 };
  equal(fleetOf({ link: "LOST", ageS: 9 }, late, never, {}), {
    state: "late",
    key: "stop.part_fleet",
    slots: { count: 2, total: 4 },
  });
  equal(fleetOf(late, {}).key, "stop.late_fleet");
});

const STATES = [null, "REQUESTED", "SENT", "DELIVERED", "STANDING", "UNCONFIRMED"];
STATES.push("STILL_MOVING", "STALE", "RELEASING", "READY", "RUNNING");
const AGES_S = [0, 0.5, 0.9, 1, 1.1, 1.4, 1.5, 1.6, 2.9, 3, 3.1, 10, 600];
const CONNECTIONS = /** @type {const} */ (["open", "connecting", "lost", "signed-out"]);

/** Every state at every age, whether the age grew on the server or in this browser. */
function everything() {
  const ages = [...AGES_S, Number.POSITIVE_INFINITY];
  const all = STATES.flatMap((state) =>
    ages.flatMap((ageS) =>
      CONNECTIONS.map((connection) => ({ state, ageS, connection })),
    ),
  );
  return all.flatMap(({ state, ageS, connection }) =>
    [true, false].map((isServers) => {
      const waitedS = isServers || !Number.isFinite(ageS) ? 0 : ageS;
      const report_age_s = Number.isFinite(ageS) ? ageS - waitedS : null;
      const robot = { ...RESTS, report_age_s };
      const receivedAtMs = 10_000 - 1000 * waitedS;
      const stop = state ? command({ state, robot, receivedAtMs }) : null;
      return facts({ connection, command: stop, ageS, link: linkOf(ageS) });
    }),
  );
}

test("I12 no control is drawn as ready or standing from data older than its limit", () => {
  const limits = new Map([
    ["ready", 1],
    ["standing", LIMITS.report_stale_s],
  ]);
  const cases = everything();
  const shown = cases.map((one) => ({ one, state: viewOfRobot(one).state }));
  const green = shown.filter(({ state }) => limits.has(state));
  const wrong = green.filter(
    ({ one, state }) =>
      one.ageS > (limits.get(state) ?? 0) || one.connection === "lost",
  );
  equal(wrong, []);
  equal([...new Set(green.map(({ state }) => state))].sort(), ["ready", "standing"]);
});

test("I12 a fleet of such robots is not drawn as ready or standing either", () => {
  const wrong = everything()
    .filter((one) => one.ageS > LIMITS.report_stale_s)
    .map((one) => {
      const { link, ageS, connection, nowMs } = one;
      const robots = [{ view: viewOfRobot(one), link, ageS }];
      return viewOfFleet({ connection, press: null, nowMs, robots }).state;
    })
    .filter((state) => state === "ready" || state === "standing");
  equal(wrong, []);
});

test("I12 a standstill that nobody repeats becomes one of the past by itself", () => {
  const stop = command({ kind: "stop", state: "STANDING", robot: RESTS });
  stop.receivedAtMs = 7_000;
  equal(viewOfRobot(facts({ command: stop })), {
    state: "stale",
    key: "stop.stale",
    slots: { seconds: 3.1 },
  });
});
