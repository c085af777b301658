/**
 * Guards the rule against a careless form: a change that lowers protection is explained,
 * waits for a confirmation, and can be undone for ten minutes.
 */

import { sendApi } from "../core/api.js";
import { need, setHidden, setText } from "../panels/dom.js";
import { loweringsOf } from "./lowering.js";
import { valuesOf } from "./parameters.js";

/** @typedef {import("../core/protocol.js").Rule} Rule */
/** @typedef {import("./lowering.js").Change} Change */
/** @typedef {{status: number, body: any}} Answer */

const UNDO_MS = 600_000;
const KEPT = "iveg_rule_before";
const TICK_MS = 1000;

/**
 * @param {import("../core/store.js").Store} store
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {import("./parameters.js").Parameter[]} parameters
 */
export function createGuard(store, i18n, parameters) {
  const box = need("#guard");
  const undo = /** @type {HTMLButtonElement} */ (need("#rule-undo"));
  /** @type {(isMeant: boolean) => void} */
  let answer = () => {};

  /**
   * Asks where a change protects less; a trial tells what it would do.
   *
   * @param {Change} change @param {Rule} before
   * @returns {boolean | Promise<boolean>}
   */
  function isMeant(change, before) {
    const lowerings = loweringsOf(parameters, before, change);
    if (!lowerings.length) return true;
    close(false);
    const told = lowerings.map(({ key, slots }) => i18n.t(key, slots));
    setText(need("#guard-says"), told.join(" "));
    setHidden(box, false);
    need("#guard-no").focus();
    return new Promise((resolve) => {
      answer = resolve;
    });
  }

  /** @param {boolean} isYes */
  function close(isYes) {
    setHidden(box, true);
    answer(isYes);
    answer = () => {};
  }

  /**
   * Makes a change, after a confirmation where it lowers protection.
   *
   * @param {Change & {version: number}} change
   * @returns {Promise<Answer | null>} null: it is not, and what was typed stays
   */
  async function put(change) {
    /** @type {Rule | undefined} */
    const before = store.get("rule");
    if (before && !(await isMeant(change, before))) return null;
    const found = await sendApi("PUT", "rule", change);
    if (
      found.status === 200 &&
      before &&
      loweringsOf(parameters, before, change).length
    ) {
      keep({ before, untilMs: Date.now() + UNDO_MS });
    }
    draw();
    return found;
  }

  async function takeBack() {
    const kept = read();
    if (!kept) return;
    const { status } = await sendApi("PUT", "rule", {
      ...valuesOf(parameters, kept.before),
      aliases: kept.before.aliases,
      version: store.get("rule")?.version,
    });
    if (status === 200) keep(null);
    const said = status === 200 ? "lowering.undone" : "rule.stale";
    setText(need("#rule-result"), i18n.t(said));
    draw();
  }

  function draw() {
    const kept = read();
    const minutes = kept ? Math.ceil((kept.untilMs - Date.now()) / 60_000) : 0;
    setHidden(undo, minutes <= 0);
    setText(undo, i18n.t("lowering.undo", { minutes }));
  }

  need("#guard-yes").addEventListener("click", () => close(true));
  need("#guard-no").addEventListener("click", () => close(false));
  undo.addEventListener("click", takeBack);
  i18n.onChange(draw);
  setInterval(draw, TICK_MS);
  draw();
  return { put };
}

/**
 * Tells at a form how its change went.
 *
 * @param {Answer | null} answer of `put`
 * @param {{fill: (rule: Rule) => void, renew: () => void,
 *   say: (key: string, slots?: Record<string, string | number>) => void}} form `renew`
 *   takes the newest version as the one that the person has seen
 */
export function tellAnswer(answer, { fill, renew, say }) {
  if (!answer) return say("lowering.kept");
  const { status, body } = answer;
  if (status === 200 && body) {
    fill(body);
    return say("rule.saved", { version: body.version });
  }
  if (status === 409) {
    // Told once; a second press confirms it.
    renew();
    return say("rule.stale");
  }
  if (status === 0) return say("rows.offline");
  return say("rule.refused", { why: String(body?.detail ?? status) });
}

/** @param {{before: Rule, untilMs: number} | null} kept */
function keep(kept) {
  sessionStorage.setItem(KEPT, JSON.stringify(kept));
}

/** @returns {{before: Rule, untilMs: number} | null} */
function read() {
  const kept = JSON.parse(sessionStorage.getItem(KEPT) ?? "null");
  return kept && kept.untilMs > Date.now() ? kept : null;
}
