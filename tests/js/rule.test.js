import { Store } from "../../iveg/static/js/core/store.js";
import { createRuleForm } from "../../iveg/static/js/pages/rule.js";
import { stateSaid } from "../../iveg/static/js/pages/what_if.js";
import { questionOf } from "../../iveg/static/js/pages/yesterday.js";
import { make } from "../../iveg/static/js/panels/dom.js";
import { equal, test } from "./harness.js";

const RULE = {
  id: "fleet-alert",
  version: 1,
  confidence_threshold: 0.855,
  radius_m: 2,
  foresight: true,
  foresight_s: 3,
};
const i18n = /** @type {import("../../iveg/static/js/core/i18n.js").I18n} */ (
  /** @type {unknown} */ ({
    t: (/** @type {string} */ key) => key,
    onChange: () => {},
  })
);

/** A form that shows `RULE`, and what it has sent. */
function makeForm() {
  const form = make("form");
  const fields = ["threshold", "radius", "foresight"].map((name) => {
    const field = make("input");
    field.type = "number";
    field.step = "any";
    field.id = `rule-new-${name}`;
    return field;
  });
  const lines = ["rule-note", "rule-result"].map((id) => {
    const line = make("p");
    line.id = id;
    return line;
  });
  form.id = "rule-form";
  form.append(...fields);
  const preview = make("button");
  preview.id = "rule-preview";
  document.body.replaceChildren(form, preview, ...lines);
  const store = new Store({ schedule: (flush) => flush() });
  store.apply("rule", { ...RULE });
  /** @type {object[]} */
  const sent = [];
  const put = async (/** @type {object} */ change) => {
    sent.push(change);
    return null;
  };
  createRuleForm(store, i18n, { put });
  const [threshold, radius, horizon] = fields;
  return { form, threshold, radius, horizon, sent };
}

test("a press on a rule that nobody edited changes nothing and says so", () => {
  const { form, sent } = makeForm();
  form.requestSubmit();
  equal(sent, []);
  equal(document.querySelector("#rule-result")?.textContent, "rule.unchanged");
});

test("only what was edited is sent: the threshold in force is finer than shown", () => {
  const { form, threshold, radius, sent } = makeForm();
  equal(threshold.value, "86");
  radius.value = "2.5";
  form.requestSubmit();
  equal(sent, [{ radius_m: 2.5, version: 1 }]);
});

test("how far the rule looks ahead is changed here, too", () => {
  const { form, horizon, sent } = makeForm();
  horizon.value = "1.5";
  form.requestSubmit();
  equal(sent, [{ foresight_s: 1.5, version: 1 }]);
});

test("yesterday is asked about with what was typed, midnight to midnight in Madrid", () => {
  // The day after summer time ended: yesterday had 25 hours.
  const now = Date.parse("2026-10-26T09:00:00Z");
  const rule = /** @type {any} */ ({ ...RULE, class_thresholds: { person: 0.7 } });
  equal(questionOf(rule, { foresight_s: 1.5 }, now), {
    since: "2026-10-24T22:00:00.000Z",
    until: "2026-10-25T23:00:00.000Z",
    confidence_threshold: 0.7,
    radius_m: 2,
    foresight_s: 1.5,
    vary: "foresight_s",
  });
  equal(questionOf(rule, { foresight: false }, now).foresight_s, 0);
});

test("a question that failed says which part could not be read", () => {
  const said = (/** @type {string | null} */ why) =>
    stateSaid(/** @type {any} */ ({ state: "failed", progress: 0.5, why }), i18n);
  equal(["truth", "no_data", "database", "worker", null].map(said), [
    ...["whatif.truth_unreadable", "whatif.no_data", "whatif.no_history"],
    ...["whatif.failed", "whatif.failed"],
  ]);
});
