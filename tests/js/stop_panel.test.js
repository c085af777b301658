import { Store } from "../../iveg/static/js/core/store.js";
import { StopPanel } from "../../iveg/static/js/panels/stop.js";
import { command, robot, snapshot } from "./builders.js";
import { equal, test } from "./harness.js";

/** @typedef {import("../../iveg/static/js/main.js").App} App */

/** A page with a control for the fleet; frames come when the test says so. */
function page() {
  document.body.replaceChildren();
  for (const [id, tag] of [
    ["p1", "div"],
    ["stops", "section"],
    ["stops-more", "button"],
    ["stops-robots", "div"],
  ]) {
    const element = document.createElement(tag);
    element.id = id;
    document.body.append(element);
  }
  const fleet = document.createElement("button");
  fleet.dataset.stop = "fleet";
  for (const part of ["stop__who", "stop__label"]) {
    const span = document.createElement("span");
    span.className = part;
    fleet.append(span);
  }
  const robots = document.querySelector("#stops-robots") ?? "";
  document.querySelector("#stops")?.append(robots, fleet);
  sessionStorage.clear();
  /** @type {(() => void)[]} */
  const frames = [];
  const store = new Store({ schedule: (flush) => frames.push(flush) });
  const frame = () => {
    for (const flush of frames.splice(0)) flush();
  };
  return { store, frame };
}

/** The panel on such a page, with a server that takes each press. */
function panel() {
  const { store, frame } = page();
  /** @type {(string | null)[]} */
  const sent = [];
  const app = /** @type {App} */ (
    /** @type {unknown} */ ({
      store,
      i18n: { t: (/** @type {string} */ key) => key, onChange: () => {} },
      line: { sendStop: () => true, serverNow: () => 0 },
    })
  );
  const stops = new StopPanel(app, async ({ robotId }) => {
    sent.push(robotId);
    return 202;
  });
  store.setConnection("open");
  frame();
  return { stops, store, frame, sent };
}

/** @param {string} id */
const controlOf = (id) =>
  /** @type {HTMLElement} */ (document.querySelector(`[data-stop="${id}"]`));

/** @param {string} id */
const stateOf = (id) => controlOf(id).dataset.state;

/** @param {string} id */
function press(id) {
  controlOf(id).dispatchEvent(
    new PointerEvent("pointerdown", { bubbles: true, button: 0 }),
  );
}

test("a press of the fleet is answered when every robot has answered", () => {
  const { store, frame } = panel();
  const robots = ["AGI", "AGII"].map((robot_id) => robot({ robot_id }));
  store.apply("snapshot", snapshot({ robots }));
  frame();
  press("fleet");
  store.apply("commands/c1", command({ state: "DELIVERED" }));
  equal(stateOf("fleet"), "asked");
  const second = { command_id: "c2", robot_id: "AGII" };
  store.apply("commands/c2", command({ ...second, state: "DELIVERED" }));
  equal(stateOf("fleet"), "acknowledged");
});

test("an earlier STOP does not replace a newer one, its own later step does", () => {
  const { stops, store } = panel();
  const times = (/** @type {string} */ requested) => ({
    ...command().times,
    requested,
  });
  const newer = command({
    command_id: "new",
    times: times("2026-11-20T09:00:02.000Z"),
  });
  store.apply("commands/new", newer);
  store.apply(
    "commands/old",
    command({ command_id: "old", times: times("2026-11-20T09:00:01.000Z") }),
  );
  equal(stops.commandOf("AGI")?.command_id, "new");
  store.apply("commands/new", { ...newer, state: "STANDING" });
  equal(stops.commandOf("AGI")?.state, "STANDING");
});

test("a robot's state without a STOP ends no STOP that was heard just now", () => {
  const { stops, store, frame } = panel();
  store.apply("commands/c1", command());
  store.apply("robots/AGI", robot({ stop: null }));
  frame();
  equal(stops.commandOf("AGI")?.command_id, "c1");
  store.apply("commands/c1", command({ state: "RUNNING" }));
  equal(stops.commandOf("AGI"), undefined);
});

test("a page that is opened during a resume knows that it is one", () => {
  const { stops, store, frame } = panel();
  const resume = command({ command_id: "c2", kind: "resume", state: "RELEASING" });
  store.apply("snapshot", snapshot({ commands: [command(), resume] }));
  frame();
  equal(stops.isResuming("AGI"), true);
  store.apply("commands/c3", command({ command_id: "c3", kind: "release" }));
  equal(stops.isResuming("AGI"), false);
});
