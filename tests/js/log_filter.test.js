import { entryAt, sentenceOf } from "../../iveg/static/js/panels/log.js";
import { createChosen, facetsOf } from "../../iveg/static/js/panels/log_filter.js";
import { equal, test } from "./harness.js";
import { memory } from "./memory.js";

/** @param {object} [differs] */
const entry = (differs = {}) =>
  /** @type {import("../../iveg/static/js/core/protocol.js").Entry} */ ({
    id: 1,
    at: "2026-11-20T12:00:00.000Z",
    kind: "speed",
    robot_id: "AGII",
    key: "log.speed_down.person_nlos",
    slots: { reason: "person" },
    class: "person",
    decision_id: null,
    ...differs,
  });
const P1 = entry({
  kind: "alert",
  key: "log.alert.raised",
  class: null,
  slots: { priority: "P1" },
});

test("a slow-down names the rule that fired, whether or not it was seen", () => {
  equal(facetsOf(entry()).rule, "person");
  equal(facetsOf(entry({ key: "log.speed_up" })).rule, null);
});

test("an alert names its priority, and no rule", () => {
  equal([facetsOf(P1).priority, facetsOf(P1).rule], ["P1", null]);
});

test("no chip pressed admits everything", () => {
  const chosen = createChosen(null);
  equal([entry(), P1].map(chosen.admits), [true, true]);
});

test("within a group any may match, across groups all must", () => {
  const chosen = createChosen(null);
  chosen.toggle("rule", "person");
  chosen.toggle("rule", "stale");
  equal([entry(), P1].map(chosen.admits), [true, false]);
  chosen.toggle("robot", "AGI");
  equal(chosen.admits(entry()), false);
  equal(chosen.admits(entry({ robot_id: "AGI" })), true);
});

test("what is pressed is remembered, until it is cleared", () => {
  const storage = memory();
  createChosen(storage).toggle("priority", "P1");
  const chosen = createChosen(storage);
  equal(chosen.all(), [{ group: "priority", name: "P1" }]);
  chosen.clear();
  equal(createChosen(storage).all(), []);
});

test("a memory that is no memory of ours filters nothing", () => {
  for (const text of ["nonsense", "null", '{"kind":"speed"}', "[1]"]) {
    const storage = memory();
    storage.setItem("iveg.log", text);
    equal(createChosen(storage).all(), []);
  }
});

test("13.9 a slow-down far from anybody says that the ring had grown", () => {
  const words = /** @type {import("../../iveg/static/js/core/i18n.js").I18n} */ (
    /** @type {unknown} */ ({ t: (/** @type {string} */ key) => key })
  );
  const slots = { reason: "person", distance: 5.2 };
  equal(sentenceOf(entry({ slots }), words), "log.speed_down.person_nlos");
  equal(
    sentenceOf(entry({ slots: { ...slots, radius: 6, unseen: 2.5 } }), words),
    "log.speed_down.person_nlos log.grown",
  );
});

test("13.15: the strip leads to the log's newest entry of that time", () => {
  const at = (/** @type {number} */ second) =>
    /** @type {any} */ ({ id: second, at: `2026-11-20T12:00:0${second}.000Z` });
  const entries = [at(1), at(3), at(5)];
  const moment = (/** @type {number} */ second) => Date.parse(at(second).at);
  equal(
    [4, 5, 9, 0].map((second) => entryAt(entries, moment(second))?.id),
    [3, 5, 5, 1],
  );
  equal(entryAt([], moment(1)), undefined);
});
