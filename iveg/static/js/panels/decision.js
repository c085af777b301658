/**
 * One decision from sighting to slower wheels, link by link (product section 6): in a
 * panel over any page, and on a page of its own that can be shared and printed.
 */

import { readApi } from "../api.js";
import { make, need } from "./dom.js";

/**
 * @typedef {{link: string, at: string | number | null,
 *   value: string | number | null,
 *   verdict: "ok" | "late" | "missing" | "n/a" | "open" | "unknown"}} Link
 * @typedef {{decision_id: string, kind: string, robot_id: string | null,
 *   person_id: string | null, started_at: string | null, ended_at: string | null,
 *   links: Link[], sentence: {key: string, slots: Record<string, any>} | null}} Decision
 */

/** @param {{words: import("../i18n.js").Words, dialogs: any}} app */
export function createDecisionPanel({ words, dialogs }) {
  const panel = /** @type {HTMLDialogElement} */ (need("#decision-panel"));
  const record = createRecord(need("#decision"), words);

  /** @param {string} decisionId @param {HTMLElement | null} opener */
  function open(decisionId, opener) {
    dialogs.open(panel, opener);
    return record.show(decisionId);
  }

  return { open };
}

/**
 * @param {HTMLElement} place
 * @param {import("../i18n.js").Words} words
 */
export function createRecord(place, words) {
  /** @type {Decision | null} */
  let shown = null;
  let asked = "";

  /** @param {string} decisionId */
  async function show(decisionId) {
    asked = decisionId;
    shown = null;
    place.replaceChildren(make("p", "empty", words.t("decision.loading")));
    const path = `decisions/${encodeURIComponent(decisionId)}`;
    const { status, body } = await readApi(path);
    if (asked !== decisionId) return;
    shown = status === 200 ? body : null;
    place.setAttribute("aria-busy", "false");
    if (shown) draw();
    else
      place.replaceChildren(make("p", "empty", words.t("decision.failed", { status })));
  }

  function draw() {
    if (!shown) return;
    const { sentence } = shown;
    const head = sentence ? words.t(sentence.key, sentence.slots) : shown.kind;
    const chain = make("ol", "chain");
    chain.append(...(shown.links ?? []).map((link) => makeLink(link, words)));
    const began = shown.started_at ? words.time(shown.started_at) : "—";
    const ended = shown.ended_at
      ? `${words.t("decision.ended")} ${words.time(shown.ended_at)}`
      : words.t("decision.running");
    place.replaceChildren(
      make("p", "decision__sentence", `${dateOf(shown, words)}${head}`),
      make("small", "", `${words.t("decision.started")} ${began} · ${ended}`),
      chain,
      make("small", "", `${words.t("decision.id")} ${shown.decision_id}`),
      makeShare(shown.decision_id, words),
    );
  }

  words.onChange(draw);
  return { show };
}

/** When it was, as the sentence to share begins. @param {Decision} decision
 * @param {import("../i18n.js").Words} words */
function dateOf({ started_at }, words) {
  return started_at ? `${words.time(started_at)} ` : "";
}

/** @param {string} decisionId @param {import("../i18n.js").Words} words */
function makeShare(decisionId, words) {
  const line = make("p", "record__link");
  const link = make("a", "", words.t("decision.link_to"));
  link.href = `/decisions/${encodeURIComponent(decisionId)}`;
  const copy = make("button", "button no-print", words.t("decision.copy"));
  copy.type = "button";
  // A clipboard takes HTTPS or the computer itself; the link can be copied by hand.
  copy.hidden = !navigator.clipboard;
  copy.addEventListener("click", async () => {
    await navigator.clipboard.writeText(link.href);
    copy.textContent = words.t("decision.copied");
  });
  line.append(link, copy);
  return line;
}

/** @param {Link} link @param {import("../i18n.js").Words} words */
function makeLink(link, words) {
  const item = make("li");
  item.dataset.verdict = link.verdict;
  const name = words.has(`decision.link.${link.link}`)
    ? words.t(`decision.link.${link.link}`)
    : link.link;
  const verdict = words.t(`decision.verdict.${link.verdict}`);
  const when = link.at === null ? "" : ` ${words.time(link.at)}`;
  item.append(
    make("span", "shape"),
    make("b", "", name),
    make("small", "", `${verdict}${when}`),
    make("p", "", saidOf(link, words)),
  );
  return item;
}

/** What a link found, with its unit. @param {Link} link
 * @param {import("../i18n.js").Words} words */
function saidOf({ link, value }, words) {
  if (value === null || value === undefined) return "";
  const key = `decision.said.${link}`;
  return typeof value === "number" && words.has(key)
    ? words.t(key, { value })
    : String(value);
}
