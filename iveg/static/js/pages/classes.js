/**
 * Class names of detectors, and the class that each stands for.
 *
 * A change is a new version of the rule.  A person at the form keeps the typed values
 * when another person is faster, and is told.
 *
 * @typedef {import("../core/protocol.js").Rule} Rule
 * @typedef {import("./parameters.js").Class} Class
 */

import { make, need, setHidden, setText } from "../panels/dom.js";
import { tellAnswer } from "./guard.js";
import { CLASSES } from "./parameters.js";

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
    aliases = new Map(labelsOf(rule));
    draw();
  }

  /** Whether the form has values that are not saved. */
  function isDirty() {
    const labels = Object.fromEntries(seen ? labelsOf(seen) : aliases);
    return JSON.stringify(typed()) !== JSON.stringify(labels);
  }

  const typed = () => Object.fromEntries([...aliases].sort());

  async function save() {
    if (!seen) return;
    if (!isDirty()) return say("rule.unchanged", { version: seen.version });
    const body = { aliases: typed(), version: seen.version };
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

/** Labels of a rule; a class's own name always means that class. @param {Rule} rule */
function labelsOf({ aliases = {} }) {
  const labels = Object.entries(aliases).sort();
  return labels.filter(([name]) => !CLASSES.some((own) => own === name));
}
