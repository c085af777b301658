/**
 * The form of the rule, where the server allows changes: read, write, show the outcome.
 */

import { need, setHidden, setText } from "../panels/dom.js";
import { tellAnswer } from "./guard.js";
import { dayAndTime } from "./history/local_time.js";
import { CLASSES, ownOf, valueFor, valuesOf } from "./parameters.js";

/** @typedef {import("../core/protocol.js").Rule} Rule */
/** @typedef {import("./parameters.js").Parameter} Parameter */
/** @typedef {import("./parameters.js").Class} Class */
/** @typedef {{parameter: Parameter, class_: Class | null, input: HTMLInputElement}} Field
 *   of a value for every class (null), or of a class of its own */

const WRITERS = new Set(["operator", "admin"]);

/**
 * @param {import("../core/store.js").Store} store
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {ReturnType<typeof import("./guard.js").createGuard>} guard
 * @param {Parameter[]} parameters
 */
export function createRuleForm(store, i18n, guard, parameters) {
  const form = /** @type {HTMLFormElement} */ (need("#rule-form"));
  const fields = parameters.flatMap(fieldsOf);
  /** @type {Rule | null} the version that the person at the form has seen */
  let seen = null;
  /** @type {string | null} null while nobody knows */
  let note = null;

  /** @param {Rule | null | undefined} rule */
  function take(rule) {
    if (!rule) return;
    // A person who is typing keeps the typed values, and is told of the newer version.
    if (!seen || shows(seen) || shows(rule)) fill(rule);
    else if (rule.version !== seen.version) say("rule.stale");
    draw();
  }

  /** Whether the form holds a version as it is. @param {Rule} rule */
  function shows(rule) {
    return fields.every((field) => textIn(field) === textOf(field, rule));
  }

  /** @param {Rule} rule */
  function fill(rule) {
    seen = rule;
    for (const field of fields) {
      const text = textOf(field, rule);
      if (field.parameter.unit === "switch") field.input.checked = text === "true";
      else field.input.value = text;
    }
  }

  /** @param {string} key @param {Record<string, string | number>} [slots] */
  function say(key, slots) {
    setText(need("#rule-result"), i18n.t(key, slots));
  }

  /** @param {Set<string>} verbs what the server knows: `get`, `put` */
  function open(verbs) {
    const may = WRITERS.has(document.body.dataset.role ?? "");
    const who = may ? "editable" : "role";
    note = verbs.has("put") ? who : "readonly";
    setHidden(form, !verbs.has("put") || !may);
    draw();
  }

  /** What was edited alone: a value in force may be finer than the form shows it.
   * @param {Rule} rule */
  function typed(rule) {
    const edited = fields.filter((field) => textIn(field) !== textOf(field, rule));
    return Object.fromEntries(
      edited.map(({ parameter, class_, input }) =>
        class_ === null
          ? [parameter.key, numberIn(parameter, input)]
          : [parameter.class_key, ownValues(parameter, rule)],
      ),
    );
  }

  /** @param {Parameter} parameter @param {Rule} rule */
  function ownValues(parameter, rule) {
    const own = fields.flatMap((field) => {
      const { class_, input } = field;
      const isOwn = field.parameter === parameter && class_ !== null && input.value;
      if (!isOwn) return [];
      const isKept = input.value === textOf(field, rule);
      const kept = ownOf(parameter, rule, class_);
      return [[class_, isKept ? kept : numberIn(parameter, input)]];
    });
    return Object.fromEntries(own);
  }

  async function save() {
    if (!seen) return;
    if (shows(seen)) return say("rule.unchanged", { version: seen.version });
    // The server detects an outdated version by its number.
    const answer = await guard.put({ ...typed(seen), version: seen.version });
    tellAnswer(answer, { fill, renew, say });
  }

  /** The rule that the form describes. */
  function values() {
    return seen ? { ...valuesOf(parameters, seen), ...typed(seen) } : {};
  }

  function renew() {
    seen = store.get("rule") ?? seen;
  }

  function draw() {
    /** @type {Rule | null | undefined} */
    const rule = store.get("rule");
    const since =
      rule?.since && rule.author
        ? i18n.t("rule.since", { at: dayAndTime(rule.since), who: rule.author })
        : "";
    const told = i18n.t(note ? `rule.${note}` : "rows.loading");
    setText(need("#rule-note"), `${told} ${since}`.trim());
  }

  form.addEventListener("submit", (event) => {
    event.preventDefault();
    save();
  });
  store.subscribe("rule", take);
  i18n.onChange(draw);
  take(store.get("rule"));
  return { open, values, isDirty: () => seen !== null && !shows(seen) };
}

/** @param {Parameter} parameter @returns {Field[]} */
function fieldsOf(parameter) {
  const id = `#rule-new-${parameter.word}`;
  const own = parameter.class_key === null ? [] : CLASSES;
  return [
    { parameter, class_: null, input: inputOf(id) },
    ...own.map((class_) => ({ parameter, class_, input: inputOf(`${id}-${class_}`) })),
  ];
}

/** @param {string} id */
const inputOf = (id) => /** @type {HTMLInputElement} */ (need(id));

/** @param {Field} field */
function textIn({ parameter, input }) {
  return parameter.unit === "switch" ? String(input.checked) : input.value;
}

/** A value as its field shows it. @param {Field} field @param {Rule} rule */
function textOf({ parameter, class_ }, rule) {
  const value =
    class_ === null ? valueFor(parameter, rule, null) : ownOf(parameter, rule, class_);
  if (value === undefined) return "";
  return String(parameter.unit === "share" ? Math.round(Number(value) * 100) : value);
}

/** @param {Parameter} parameter @param {HTMLInputElement} input */
function numberIn({ unit }, input) {
  if (unit === "switch") return input.checked;
  return unit === "share" ? input.valueAsNumber / 100 : input.valueAsNumber;
}
