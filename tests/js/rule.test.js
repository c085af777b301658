import { Store } from "../../iveg/static/js/core/store.js";
import { CLASSES } from "../../iveg/static/js/pages/parameters.js";
import { createRuleForm } from "../../iveg/static/js/pages/rule.js";
import { make } from "../../iveg/static/js/panels/dom.js";
import { equal, test } from "./harness.js";
import { PARAMETERS } from "./rule_table.js";

const RULE = {
  id: "fleet-alert",
  version: 1,
  confidence_threshold: 0.855,
  class_thresholds: {},
  radius_m: 2,
  class_radii_m: { robot: 3 },
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
  const words = ["threshold", "radius"].flatMap((word) => [
    word,
    ...CLASSES.map((class_) => `${word}-${class_}`),
  ]);
  const fields = [...words, "foresight", "foresight_s"].map((name) => {
    const field = make("input");
    field.type = name === "foresight" ? "checkbox" : "number";
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
  const { values } = createRuleForm(store, i18n, { put }, PARAMETERS);
  /** @param {string} name */
  const field = (name) => fields[[...words, "foresight"].indexOf(name)];
  return { form, field, sent, values };
}

test("only what was edited is sent: the threshold in force is finer than shown", () => {
  const { form, field, sent } = makeForm();
  equal(field("threshold").value, "86");
  field("radius").value = "2.5";
  form.requestSubmit();
  equal(sent, [{ radius_m: 2.5, version: 1 }]);
});

test("a trial is begun from what the form says, as fine as the rule in force", () => {
  const { values, field } = makeForm();
  field("radius").value = "2.5";
  equal(values(), {
    confidence_threshold: 0.855,
    class_thresholds: {},
    radius_m: 2.5,
    class_radii_m: { robot: 3 },
    foresight: true,
    foresight_s: 3,
  });
});

test("a value of a class is sent with those of the other classes, an empty one not", () => {
  const { form, field, sent } = makeForm();
  equal([field("radius-person").value, field("radius-robot").value], ["", "3"]);
  field("radius-person").value = "2.5";
  field("foresight").checked = false;
  form.requestSubmit();
  field("radius-robot").value = "";
  form.requestSubmit();
  equal(sent, [
    { class_radii_m: { person: 2.5, robot: 3 }, foresight: false, version: 1 },
    { class_radii_m: { person: 2.5 }, foresight: false, version: 1 },
  ]);
});
