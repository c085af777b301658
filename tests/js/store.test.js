import { ageOf } from "../../iveg/static/js/core/clock.js";
import { Store } from "../../iveg/static/js/core/store.js";
import { command, entry, person, robot, snapshot } from "./builders.js";
import { equal, near, test } from "./harness.js";

/** A store whose frames come when the test says so. */
function storeByHand() {
  /** @type {(() => void)[]} */
  const frames = [];
  const store = new Store({ now: () => 0, schedule: (flush) => frames.push(flush) });
  const frame = () => {
    for (const flush of frames.splice(0)) flush();
  };
  /** @type {string[]} */
  const heard = [];
  /** @param {string} pattern */
  const hear = (pattern) =>
    store.subscribe(pattern, (_, topic) => void heard.push(topic));
  return { store, frame, heard, hear };
}

test("a snapshot replaces everything that was known", () => {
  const { store } = storeByHand();
  store.apply("snapshot", snapshot({ people: [person()], log: [entry(1)] }), 0);
  store.apply("robots/AGI/scan", { robot_id: "AGI", points: new Float32Array(2) }, 0);
  store.apply("snapshot", snapshot({ robots: [robot({ robot_id: "AGII" })] }), 1);
  equal([...store.robots().keys()], ["AGII"]);
  equal([store.people().length, store.scans().size, store.log().length], [0, 0, 0]);
  equal(store.get("robots/AGI"), undefined);
});

test("a robot's older state never replaces a newer one", () => {
  const { store } = storeByHand();
  const newer = robot({ received_at: "2026-11-20T09:00:02.000Z", mode: "SLOW" });
  store.apply("robots/AGI", newer, 0);
  store.apply("robots/AGI", robot({ received_at: "2026-11-20T09:00:01.000Z" }), 1);
  equal(store.robots().get("AGI")?.mode, "SLOW");
});

test("a robot's move and its state are told as the robot, whole", () => {
  const { store, frame } = storeByHand();
  store.apply("snapshot", snapshot(), 0);
  /** @type {any[]} */
  const told = [];
  store.subscribe("robots/AGI", (data) => told.push(data));
  const pose = { x: 9, y: 8, yaw: 1 };
  store.apply("robots/AGI/move", { robot_id: "AGI", age_s: 0, pose, stamp: "new" }, 10);
  store.apply("robots/AGI/state", { mode: "SLOW" }, 20);
  frame();
  const { pose: at, stamp, mode, link } = told[told.length - 1];
  equal([at, stamp, mode, link], [pose, "new", "SLOW", "LIVE"]);
  equal(store.get("robots/AGI"), store.robots().get("AGI"));
});

test("the ages of a pose and of a state count from when each was true", () => {
  const { store } = storeByHand();
  const applied = {
    reason: "clear",
    cause: null,
    age_s: 2,
    feedback_age_s: 0,
    faults: [],
    obstacle: null,
  };
  store.apply("snapshot", snapshot({ robots: [robot({ age_s: 0.5, applied })] }), 1000);
  const known = () => store.robots().get("AGI");
  const stateAge = () =>
    ageOf({ ...known()?.applied, receivedAtMs: known()?.receivedAtMs }, 9000);
  near(ageOf(known(), 9000), 8.5);
  near(stateAge(), 10);
  store.apply("robots/AGI/move", { robot_id: "AGI", age_s: 0.1 }, 5000);
  near(ageOf(known(), 9000), 4.1);
  near(stateAge(), 10);
  store.apply("robots/AGI/state", { applied: { ...applied, age_s: 0.2 } }, 6000);
  near(ageOf(known(), 9000), 4.1);
  near(stateAge(), 3.2);
});

test("of people is told who has changed; the others grow older", () => {
  const { store, frame } = storeByHand();
  const [one, two, three] = ["P1", "P2", "P3"].map((person_id) =>
    person({ person_id }),
  );
  store.apply("snapshot", snapshot({ people: [one, two] }), 1000);
  /** @type {string[][]} */
  const told = [];
  store.subscribe("people", (all) =>
    told.push(all.map((/** @type {any} */ it) => it.person_id)),
  );
  frame();
  store.apply("people/P3", three, 2000);
  store.apply("people/ids", ["P1", "P3"], 2000);
  frame();
  equal(told, [
    ["P1", "P2"],
    ["P1", "P3"],
  ]);
  near(ageOf(store.people()[0], 3000), 2.1);
  near(ageOf(store.people()[1], 3000), 1.1);
});

test("a command that follows a snapshot is told after it, and after the snapshot's own", () => {
  const { store } = storeByHand();
  /** @type {string[]} */
  const heard = [];
  for (const topic of ["snapshot", "commands/"])
    store.subscribe(topic, (data) => void heard.push(data.state ?? "snapshot"));

  store.apply("snapshot", snapshot({ commands: [command({ state: "SENT" })] }));
  store.apply("commands/c1", command({ state: "DELIVERED" }));

  equal(heard, ["snapshot", "SENT", "DELIVERED"]);
});
