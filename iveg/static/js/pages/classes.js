/**
 * Class names of detectors: the class of each, and the threshold of each class.
 *
 * A change is a new version of the rule.  A person at the form keeps the typed values
 * when another person is faster, and is told.
 *
 * @typedef {import("../core/protocol.js").Rule} Rule
 * @typedef {"person" | "robot"} Class
 */

import { make, need, setHidden, setText } from "../panels/dom.js";
import { tellAnswer } from "./guard.js";

/** @type {readonly Class[]} */
const CLASSES = ["person", "robot"];
const WRITERS = new Set(["operator", "admin"]);

/**
 * @param {import("../core/store.js").Store} store
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {ReturnType<typeof import("./guard.js").createGuard>} guard
 */
export function createClassForm(store, i18n, guard) {
  const form = /** @type {HTMLFormElement} */ (need("#class-form"));
  const word = /** @type {HTMLInputElement} */ (need("#alias-word"));
  const meaning = /** @type {HTMLSelectElement} */ (need("#alias-class"));
  const foresight = /** @type {HTMLInputElement} */ (need("#class-foresight"));
  /** @type {Rule | null} the version that the person at the form has seen */
  let seen = null;
  /** @type {Map<string, Class>} */
  let aliases = new Map();
  /** @type {{key: string, slots: Record<string, string | number>} | null} */
  let said = null;

  /** @param {Rule | null | undefined} rule */
  function take(rule) {
    if (!rule) return;
    if (!seen || !isDirty()) {
      fill(rule);
    } else if (rule.version !== seen.version) say("rule.stale");
  }

  /** @param {Rule} rule */
  function fill(rule) {
    seen = rule;
    aliases = new Map(Object.entries(writtenOf(rule).aliases));
    for (const name of CLASSES) {
      const share = rule.class_thresholds?.[name];
      thresholdOf(name).value =
        share === undefined ? "" : String(Math.round(share * 100));
    }
    foresight.checked = rule.foresight === true;
    draw();
  }

  /** Whether the form has values that are not saved. */
  function isDirty() {
    if (!seen) return false;
    return JSON.stringify(typed()) !== JSON.stringify(writtenOf(seen));
  }

  /** The values of the form, as the API takes them. */
  function typed() {
    const thresholds = CLASSES.flatMap((name) => {
      const share = thresholdOf(name).valueAsNumber;
      return Number.isNaN(share) ? [] : [[name, share / 100]];
    });
    return {
      class_thresholds: Object.fromEntries(thresholds),
      aliases: Object.fromEntries([...aliases].sort()),
      foresight: foresight.checked,
    };
  }

  async function save() {
    if (!seen) return;
    if (!isDirty()) return say("rule.unchanged", { version: seen.version });
    // Only what was edited: a threshold in force may be finer than the form shows it.
    const before = /** @type {Record<string, unknown>} */ (writtenOf(seen));
    const edited = Object.entries(typed()).filter(
      ([key, value]) => JSON.stringify(value) !== JSON.stringify(before[key]),
    );
    const body = { ...Object.fromEntries(edited), version: seen.version };
    tellAnswer(await guard.put(body), { fill, renew, say });
  }

  function renew() {
    seen = store.get("rule") ?? seen;
  }

  function add() {
    const name = word.value.trim().toLowerCase();
    if (!name || CLASSES.some((own) => own === name))
      return say("classes.own", { name });
    aliases.set(name, /** @type {Class} */ (meaning.value));
    word.value = "";
    draw();
    say("classes.unsaved");
    return word.focus();
  }

  /** @param {string} name */
  function remove(name) {
    aliases.delete(name);
    draw();
    say("classes.unsaved");
    // The button that was pressed is gone; the focus must not go with it.
    word.focus();
  }

  /** @param {string} key @param {Record<string, string | number>} [slots] */
  function say(key, slots = {}) {
    said = { key, slots };
    setText(need("#class-result"), i18n.t(key, slots));
  }

  function draw() {
    const rows = [...aliases].sort().map(([name, class_]) => makeRow(name, class_));
    need("#aliases").replaceChildren(...rows);
    if (said) say(said.key, said.slots);
  }

  /** @param {string} name @param {Class} class_ */
  function makeRow(name, class_) {
    const item = make("li", "alias");
    const gone = make("button", "button alias__remove", i18n.t("classes.remove"));
    gone.type = "button";
    gone.ariaLabel = i18n.t("classes.remove_one", { name });
    gone.addEventListener("click", () => remove(name));
    const meant = make("span", "", i18n.t("classes.means", { class: class_ }));
    item.append(make("b", "", name), meant, gone);
    return item;
  }

  /** @param {Set<string>} verbs what the server knows: `get`, `put` */
  function open(verbs) {
    const may = verbs.has("put") && WRITERS.has(document.body.dataset.role ?? "");
    /** @type {HTMLFieldSetElement} */ (need("#class-fields")).disabled = !may;
    setHidden(need("#class-save"), !may);
  }

  need("#alias-add").addEventListener("click", add);
  word.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    // Enter in this field adds this name; it does not send the form.
    event.preventDefault();
    add();
  });
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    save();
  });
  store.subscribe("rule", take);
  i18n.onChange(draw);
  take(store.get("rule"));
  return { open, isDirty };
}

/** @param {Class} name */
function thresholdOf(name) {
  return /** @type {HTMLInputElement} */ (need(`#class-${name}`));
}

/**
 * The values of a rule in the form; a class's own name always means that class.
 *
 * @param {Rule} rule
 */
export function writtenOf(rule) {
  const { aliases = {}, class_thresholds = {}, foresight } = rule;
  const given = Object.entries(aliases).filter(
    ([name]) => !CLASSES.some((own) => own === name),
  );
  const shares = CLASSES.flatMap((name) => {
    const share = class_thresholds[name];
    return share === undefined ? [] : [[name, Math.round(share * 100) / 100]];
  });
  return {
    class_thresholds: Object.fromEntries(shares),
    aliases: /** @type {Record<string, Class>} */ (Object.fromEntries(given.sort())),
    foresight: foresight === true,
  };
}
