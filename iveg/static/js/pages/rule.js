/**
 * The form of the rule, where the server allows changes: read, write, show the outcome.
 */

import { need, setHidden, setText } from "../panels/dom.js";
import { tellAnswer } from "./guard.js";
import { dayAndTime } from "./history/local_time.js";
import { askYesterday } from "./yesterday.js";

/** @typedef {import("../core/protocol.js").Rule} Rule */

const WRITERS = new Set(["operator", "admin"]);

/**
 * @param {import("../core/store.js").Store} store
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {ReturnType<typeof import("./guard.js").createGuard>} guard
 */
export function createRuleForm(store, i18n, guard) {
  const form = /** @type {HTMLFormElement} */ (need("#rule-form"));
  const [threshold, radius, horizon] = /** @type {HTMLInputElement[]} */ (
    ["threshold", "radius", "foresight"].map((name) => need(`#rule-new-${name}`))
  );
  const preview = /** @type {HTMLButtonElement} */ (need("#rule-preview"));
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
    return (
      threshold.value === percentOf(rule) &&
      radius.value === String(rule.radius_m) &&
      horizon.value === String(rule.foresight_s)
    );
  }

  /** @param {Rule} rule */
  function fill(rule) {
    seen = rule;
    threshold.value = percentOf(rule);
    radius.value = String(rule.radius_m);
    horizon.value = String(rule.foresight_s);
    horizon.disabled = rule.foresight !== true;
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

  /** What was typed; the threshold in force may be finer than the form shows it.
   * @param {Rule} rule */
  function typed(rule) {
    return {
      ...(threshold.value !== percentOf(rule) && {
        confidence_threshold: threshold.valueAsNumber / 100,
      }),
      ...(radius.value !== String(rule.radius_m) && { radius_m: radius.valueAsNumber }),
      ...(horizon.value !== String(rule.foresight_s) && {
        foresight_s: horizon.valueAsNumber,
      }),
    };
  }

  async function save() {
    if (!seen) return;
    if (shows(seen)) return say("rule.unchanged", { version: seen.version });
    // The server detects an outdated version by its number.
    const answer = await guard.put({ ...typed(seen), version: seen.version });
    tellAnswer(answer, { fill, renew, say });
  }

  /** Says what the values of the form would have cost yesterday; changes nothing. */
  async function look() {
    if (!seen || !form.reportValidity()) return;
    preview.disabled = true;
    await askYesterday(seen, typed(seen), ({ key, slots }) => say(key, slots));
    preview.disabled = false;
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
  preview.addEventListener("click", look);
  store.subscribe("rule", take);
  i18n.onChange(draw);
  take(store.get("rule"));
  return { open, isDirty: () => seen !== null && !shows(seen) };
}

/** @param {Rule} rule */
function percentOf({ confidence_threshold }) {
  return String(Math.round(confidence_threshold * 100));
}
