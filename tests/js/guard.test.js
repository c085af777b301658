import { Store } from "../../iveg/static/js/core/store.js";
import { createGuard } from "../../iveg/static/js/pages/guard.js";
import { make } from "../../iveg/static/js/panels/dom.js";
import { equal, test, until } from "./harness.js";

const RULE = {
  id: "fleet-alert",
  version: 1,
  confidence_threshold: 0.8,
  radius_m: 2,
  foresight: true,
  foresight_s: 3,
};
const i18n = /** @type {import("../../iveg/static/js/core/i18n.js").I18n} */ (
  /** @type {unknown} */ ({
    t: (/** @type {string} */ key, /** @type {object} */ slots = {}) =>
      [key, ...Object.values(slots)].join(" "),
    onChange: () => {},
  })
);
const PARTS = ["guard", "guard-says", "guard-today", "guard-yesterday", "rule-result"];

/** A guard before a server that answers about sightings when the test says so. */
function makeGuard() {
  const buttons = ["guard-no", "guard-yes", "rule-undo"];
  document.body.replaceChildren(
    ...PARTS.map((id) => Object.assign(make("p"), { id })),
    ...buttons.map((id) => Object.assign(make("button"), { id })),
  );
  element("guard").hidden = true;
  /** @type {((probabilities: number[]) => void)[]} */
  const waiting = [];
  window.fetch = async (url) => {
    if (!String(url).includes("detections")) return new Response("", { status: 503 });
    return new Promise((resolve) => {
      waiting.push((probabilities) => {
        const items = probabilities.map((probability) => ({ probability }));
        resolve(Response.json({ items }));
      });
    });
  };
  const store = new Store({ schedule: (flush) => flush() });
  store.apply("rule", { ...RULE });
  return { guard: createGuard(store, i18n), waiting };
}

/** @param {string} id */
const element = (id) => /** @type {HTMLElement} */ (document.querySelector(`#${id}`));
/** @param {string} id */
const said = (id) => element(id).textContent;
/** Answers have been read a few turns later. */
const settled = () => new Promise((resolve) => setTimeout(resolve, 20));

test("a press that protects less asks at once, and counts when the server answers", async () => {
  const { guard, waiting } = makeGuard();
  guard.put({ confidence_threshold: 0.9, version: 1 });
  equal(
    [element("guard").hidden, said("guard-says"), said("guard-today")],
    [false, "lowering.threshold 0.8 0.9", "lowering.counting"],
  );
  waiting[0]([0.85, 0.95]);
  await until(() => said("guard-today") === "lowering.sightings 1 2");
});

test("whoever says no while it counts leaves the rule as it is", async () => {
  const { guard } = makeGuard();
  /** @type {unknown} */
  let found = "nothing yet";
  guard.put({ confidence_threshold: 0.9, version: 1 }).then((answer) => {
    found = answer;
  });
  element("guard-no").click();
  await until(() => found === null);
  equal(element("guard").hidden, true);
});

test("a count that comes late does not stand under a newer question", async () => {
  const { guard, waiting } = makeGuard();
  const first = guard.put({ confidence_threshold: 0.9, version: 1 });
  guard.put({ confidence_threshold: 0.95, version: 1 });
  waiting[1]([0.85, 0.92, 0.97]);
  await until(() => said("guard-today") === "lowering.sightings 2 3");
  waiting[0]([0.85]);
  await settled();
  equal(await first, null);
  equal(said("guard-today"), "lowering.sightings 2 3");
  guard.put({ radius_m: 1.5, version: 1 });
  equal([said("guard-says"), said("guard-today")], ["lowering.radius 2 1.5", ""]);
});
