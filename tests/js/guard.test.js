import { Store } from "../../iveg/static/js/core/store.js";
import { createGuard } from "../../iveg/static/js/pages/guard.js";
import { make } from "../../iveg/static/js/panels/dom.js";
import { equal, test, until } from "./harness.js";
import { PARAMETERS } from "./rule_table.js";

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
const PARTS = ["guard", "guard-says", "rule-result"];

/** A guard before a server that answers nothing. */
function makeGuard() {
  const buttons = ["guard-no", "guard-yes", "rule-undo"];
  document.body.replaceChildren(
    ...PARTS.map((id) => Object.assign(make("p"), { id })),
    ...buttons.map((id) => Object.assign(make("button"), { id })),
  );
  element("guard").hidden = true;
  window.fetch = async () => new Response("", { status: 503 });
  const store = new Store({ schedule: (flush) => flush() });
  store.apply("rule", { ...RULE });
  return createGuard(store, i18n, PARAMETERS);
}

/** @param {string} id */
const element = (id) => /** @type {HTMLElement} */ (document.querySelector(`#${id}`));
/** @param {string} id */
const said = (id) => element(id).textContent;

test("a press that protects less asks at once", () => {
  const guard = makeGuard();
  guard.put({ confidence_threshold: 0.9, version: 1 });
  equal(
    [element("guard").hidden, said("guard-says")],
    [false, "lowering.threshold 0.8 0.9 person lowering.threshold 0.8 0.9 robot"],
  );
});

test("whoever says no leaves the rule as it is", async () => {
  const guard = makeGuard();
  /** @type {unknown} */
  let found = "nothing yet";
  guard.put({ confidence_threshold: 0.9, version: 1 }).then((answer) => {
    found = answer;
  });
  element("guard-no").click();
  await until(() => found === null);
  equal(element("guard").hidden, true);
});

test("a newer question takes the place of the one before", async () => {
  const guard = makeGuard();
  const first = guard.put({ confidence_threshold: 0.9, version: 1 });
  guard.put({ radius_m: 1.5, version: 1 });
  equal(await first, null);
  equal(said("guard-says"), "lowering.radius 2 1.5 person lowering.radius 2 1.5 robot");
});
