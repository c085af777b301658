/**
 * Changing the rule, where the server lets somebody: read, write, say what came of it.
 */

import { readApi, sendApi } from "../api.js";
import { dayAndTime } from "../history/madrid.js";
import { need, setHidden, setText } from "../panels/dom.js";

/** @typedef {import("./settings.js").Rule & {author?: string | null,
 *   since?: string | null}} Rule */

const WRITERS = new Set(["operator", "admin"]);

/**
 * @param {import("../i18n.js").Words} words
 * @param {() => void} onRule told when `newest` has changed
 */
export function createRuleForm(words, onRule) {
  const form = /** @type {HTMLFormElement} */ (need("#rule-form"));
  const [threshold, radius] = /** @type {HTMLInputElement[]} */ (
    ["threshold", "radius"].map((name) => need(`#rule-new-${name}`))
  );
  /** @type {Rule | null} */
  let rule = null;
  /** @type {Set<string>} */
  let verbs = new Set();
  let note = "readonly";

  /** What the server answers when asked for the rule; null where it cannot be asked. */
  async function look() {
    if (!verbs.has("get")) return;
    const { status, body } = await readApi("rule");
    if (status === 200) take(body);
  }

  /** @param {Rule} found */
  function take(found) {
    const isSame = rule?.version === found.version;
    rule = found;
    // Whoever is typing keeps what they typed.
    if (!isSame) {
      threshold.value = String(Math.round(found.confidence_threshold * 100));
      radius.value = String(found.radius_m);
    }
    draw();
    onRule();
  }

  /** @param {Set<string>} found what the server knows: `get`, `put` */
  async function open(found) {
    verbs = found;
    const may = WRITERS.has(document.body.dataset.role ?? "");
    if (verbs.has("put")) note = may ? "editable" : "role";
    setHidden(form, !verbs.has("put") || !may);
    draw();
    await look();
  }

  async function save() {
    const { status, body } = await sendApi("PUT", "rule", {
      confidence_threshold: threshold.valueAsNumber / 100,
      radius_m: radius.valueAsNumber,
      // Numbers: the server tells a version that was overtaken by this one.
      version: Number(rule?.version),
    });
    const isTaken = status === 200 && body;
    if (isTaken) take(body);
    if (status === 409) await look();
    setText(need("#rule-result"), resultOf(status, body));
  }

  /** @param {number} status @param {any} body */
  function resultOf(status, body) {
    if (status === 200 && body) return words.t("rule.saved", { version: body.version });
    if (status === 409) return words.t("rule.stale");
    if (status === 0) return words.t("rows.offline");
    return words.t("rule.refused", { why: String(body?.detail ?? status) });
  }

  function draw() {
    const since =
      rule?.since && rule.author
        ? words.t("rule.since", { at: dayAndTime(rule.since), who: rule.author })
        : "";
    setText(need("#rule-note"), `${words.t(`rule.${note}`)} ${since}`.trim());
  }

  form.addEventListener("submit", (event) => {
    event.preventDefault();
    save();
  });
  words.onChange(draw);
  return { open, look, newest: () => rule };
}
