import { Store } from "../../iveg/static/js/core/store.js";
import { createRuleForm } from "../../iveg/static/js/pages/rule.js";
import { make } from "../../iveg/static/js/panels/dom.js";
import { equal, test } from "./harness.js";

const RULE = {
  id: "fleet-alert",
  version: 1,
  confidence_threshold: 0.855,
  radius_m: 2,
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
  const fields = ["threshold", "radius"].map((name) => {
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
  document.body.replaceChildren(form, ...lines);
  const store = new Store({ schedule: (flush) => flush() });
  store.apply("rule", { ...RULE });
  /** @type {object[]} */
  const sent = [];
  const put = async (/** @type {object} */ change) => {
    sent.push(change);
    return null;
  };
  createRuleForm(store, i18n, { put });
  const [threshold, radius] = fields;
  return { form, threshold, radius, sent };
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
