/**
 * Guards the rule against a careless form: a change that lowers protection is explained,
 * waits for a confirmation, and can be undone for ten minutes.
 */

import { readApi, sendApi } from "../core/api.js";
import { need, setHidden, setText } from "../panels/dom.js";
import { foreseen, loweringsOf, personShare, sightingsLost } from "./lowering.js";
import { askYesterday } from "./yesterday.js";

/** @typedef {import("../core/protocol.js").Rule} Rule */
/** @typedef {import("./lowering.js").Change} Change */
/** @typedef {{status: number, body: any}} Answer */

const UNDO_MS = 600_000;
const KEPT = "iveg_rule_before";
const TICK_MS = 1000;
/** So many of today's sightings are requested. */
const SIGHTINGS = 1000;

/**
 * @param {import("../core/store.js").Store} store
 * @param {import("../core/i18n.js").I18n} i18n
 */
export function createGuard(store, i18n) {
  const box = need("#guard");
  const undo = /** @type {HTMLButtonElement} */ (need("#rule-undo"));
  /** @type {(isMeant: boolean) => void} */
  let answer = () => {};
  /** What is asked about a change ends with the question. */
  let asking = new AbortController();

  /**
   * Asks at once: what today and yesterday say of the change is filled in as it comes, as
   * whoever is sure need not wait, and on a slow server a press would look lost.
   *
   * @param {Change} change @param {Rule} before
   * @returns {boolean | Promise<boolean>}
   */
  function isMeant(change, before) {
    const lowerings = loweringsOf(before, change);
    if (!lowerings.length) return true;
    close(false);
    asking = new AbortController();
    const told = lowerings.map(({ key, slots }) => i18n.t(key, slots));
    setText(need("#guard-says"), told.join(" "));
    tellToday(change, before, asking.signal);
    tellYesterday(change, before, asking.signal);
    setHidden(box, false);
    need("#guard-no").focus();
    return new Promise((resolve) => {
      answer = resolve;
    });
  }

  /** @param {Change} change @param {Rule} before @param {AbortSignal} signal */
  async function tellToday(change, before, signal) {
    const place = need("#guard-today");
    const counts = [
      ...sightingsAsked(change, before, signal),
      ...(before.foresight && change.foresight === false
        ? [encountersSaid(signal)]
        : []),
    ];
    setText(place, counts.length ? i18n.t("lowering.counting") : "");
    const said = await Promise.all(counts);
    if (!signal.aborted) setText(place, said.join(" "));
  }

  /** @param {Change} change @param {Rule} before @param {AbortSignal} signal */
  function tellYesterday(change, before, signal) {
    const place = need("#guard-yesterday");
    setText(place, "");
    const tell = (/** @type {import("./yesterday.js").Said} */ { key, slots }) => {
      if (!signal.aborted) setText(place, i18n.t(key, slots));
    };
    askYesterday(before, change, tell, signal);
  }

  /**
   * @param {Change} change @param {Rule} before @param {AbortSignal} signal
   * @returns {Promise<string>[]} none where people count as before
   */
  function sightingsAsked(change, before, signal) {
    const [from, to] = [personShare(before), personShare({ ...before, ...change })];
    return to > from ? [sightingsSaid(from, to, signal)] : [];
  }

  /** @param {number} from @param {number} to (0–1) @param {AbortSignal} signal */
  async function sightingsSaid(from, to, signal) {
    const day = new Date();
    day.setHours(0, 0, 0, 0);
    const query = `class=person&min_probability=${from}&since=${day.toISOString()}&limit=${SIGHTINGS}`;
    const { status, body } = await readApi(`detections?${query}`, signal);
    if (status !== 200 || !body?.items.length) return i18n.t("lowering.uncounted");
    return i18n.t("lowering.sightings", sightingsLost(body.items, from, to));
  }

  /** What foresight did today, which a rule without it would not have.
   * @param {AbortSignal} signal */
  async function encountersSaid(signal) {
    const { status, body } = await readApi("day", signal);
    const met = status === 200 ? body?.encounters : null;
    return met?.count
      ? i18n.t("lowering.encounters", foreseen(met))
      : i18n.t("lowering.uncounted");
  }

  /** @param {boolean} isYes */
  function close(isYes) {
    setHidden(box, true);
    asking.abort();
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
    if (found.status === 200 && before && loweringsOf(before, change).length) {
      keep({ before, untilMs: Date.now() + UNDO_MS });
    }
    draw();
    return found;
  }

  async function takeBack() {
    const kept = read();
    if (!kept) return;
    const { confidence_threshold, radius_m, class_thresholds, aliases } = kept.before;
    const { status } = await sendApi("PUT", "rule", {
      ...{ confidence_threshold, radius_m, class_thresholds, aliases },
      foresight: kept.before.foresight === true,
      foresight_s: kept.before.foresight_s,
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
