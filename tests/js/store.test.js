import { ageOf } from "../../iveg/static/js/core/clock.js";
import { matches } from "../../iveg/static/js/core/hub.js";
import { HUES, slotOf } from "../../iveg/static/js/core/slots.js";
import { COMMANDS_SIZE, LOG_SIZE, Store } from "../../iveg/static/js/core/store.js";
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

test("a move of a robot that nobody knows is left alone", () => {
  const { store, frame, heard, hear } = storeByHand();
  hear("robots/");
  store.apply("robots/AGX/move", { robot_id: "AGX", age_s: 0 });
  frame();
  equal([heard, store.robots().size], [[], 0]);
});

test("ages count from the arrival, in lists too", () => {
  const { store } = storeByHand();
  store.apply("people", [person({ age_s: 0.5 })], 1000);
  near(ageOf(store.people()[0], 3000), 2.5);
});

test("a state is told once a frame, with its newest value", () => {
  const { store, frame } = storeByHand();
  /** @type {number[]} */
  const told = [];
  store.subscribe("robots/AGI", (data) => told.push(data.pose.x));
  for (const x of [1, 2, 3])
    store.apply("robots/AGI", robot({ pose: { x, y: 0, yaw: 0 } }));
  equal(told, []);
  frame();
  equal(told, [3]);
});

test("telemetry is told as often as it can be read, other state in the next frame", async () => {
  const store = new Store();
  /** @type {string[]} */
  const told = [];
  for (const topic of ["robots/AGI", "alerts"]) {
    store.subscribe(topic, (_, name) => void told.push(name));
  }
  const until = performance.now() + 350;
  while (performance.now() < until) {
    store.apply("robots/AGI", robot());
    store.apply("alerts", []);
    await new Promise((done) => requestAnimationFrame(done));
  }
  const readings = told.filter((topic) => topic === "robots/AGI").length;
  equal([readings >= 1, readings <= 4], [true, true]);
  equal(told.length - readings > readings, true);
});

test("log entries and command events are told one by one, at once", () => {
  const { store, heard, hear } = storeByHand();
  hear("log");
  hear("commands/");
  store.apply("log", entry(1));
  store.apply("log", entry(2));
  store.apply("commands/c1", command());
  store.apply("commands/c1", command({ state: "STANDING" }));
  equal(heard, ["log", "log", "commands/c1", "commands/c1"]);
});

test("a snapshot is told before what it brought", () => {
  const { store, frame, heard, hear } = storeByHand();
  hear("robots/");
  hear("snapshot");
  store.apply("snapshot", snapshot());
  frame();
  equal(heard, ["snapshot", "robots/AGI"]);
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

test("who is told of a snapshot finds all of it in the store", () => {
  const { store } = storeByHand();
  /** @type {unknown[]} */
  const found = [];
  store.watch((_, topic) => {
    if (topic === "snapshot") found.push(store.robots().size, store.people().length);
  });
  store.apply("snapshot", snapshot({ people: [person()] }));
  equal(found, [1, 1]);
});

test("the log keeps its newest entries and no entry twice", () => {
  const { store } = storeByHand();
  for (let id = 1; id <= LOG_SIZE + 20; id += 1) store.apply("log", entry(id));
  store.apply("log", entry(LOG_SIZE + 20));
  equal(store.log().length, LOG_SIZE);
  equal([store.log()[0].id, store.log()[LOG_SIZE - 1].id], [21, LOG_SIZE + 20]);
});

test("only the commands last heard of are kept", () => {
  const { store } = storeByHand();
  store.apply("commands/first", command());
  store.apply("commands/second", command());
  for (let n = 2; n < COMMANDS_SIZE; n += 1) store.apply(`commands/${n}`, command());
  store.apply("commands/first", command({ state: "STANDING" }));
  store.apply("commands/last", command());
  equal(store.get("commands/first").state, "STANDING");
  equal(store.get("commands/second"), undefined);
});

test("a prefix hears one level below itself: a robot, not its scan", () => {
  equal(matches("robots/", "robots/AGI"), true);
  equal(matches("robots/", "robots/AGI/scan"), false);
  equal(matches("robots/+/scan", "robots/AGI/scan"), true);
  equal(matches("robots/AGI", "robots/AGII"), false);
  equal(matches("people", "people"), true);
});

test("who unsubscribed hears nothing any more", () => {
  const { store, frame, heard, hear } = storeByHand();
  const end = hear("people");
  end();
  store.apply("people", []);
  frame();
  equal(heard, []);
});

test("a robot keeps its hue, and ten robots have ten", () => {
  const ten = Array.from({ length: 10 }, (_, i) => `R${i}`);
  const slots = ten.map(slotOf);
  equal(new Set(slots).size, HUES);
  equal([Math.min(...slots), Math.max(...slots)], [1, HUES]);
  equal(ten.map(slotOf), slots);
});

test("a line's state is told when it changes and keeps since when", () => {
  const { store, frame, heard, hear } = storeByHand();
  hear("connection");
  store.setConnection("lost", 5000);
  store.setConnection("lost", 9000);
  frame();
  equal(heard, ["connection"]);
  equal(store.connection, { state: "lost", since: 5000 });
});

test("13.6: lines of before the server's restart come before those that are known", () => {
  const { store, frame, heard, hear } = storeByHand();
  store.apply("snapshot", snapshot({ log: [entry(7)] }), 0);
  hear("log/earlier");
  store.apply("log/earlier", [entry(5), entry(6), entry(7)], 1);
  frame();
  equal(
    store.log().map(({ id }) => id),
    [5, 6, 7],
  );
  equal(heard, ["log/earlier"]);
});
