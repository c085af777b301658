/**
 * One decision from sighting to slower wheels, link by link (product section 6).
 */

import { make, need } from "./dom.js";

/**
 * @typedef {{link: string, at: string | number | null,
 *   value: string | number | null,
 *   verdict: "ok" | "late" | "missing" | "n/a" | "open"}} Link
 * @typedef {{decision_id: string, kind: string, robot_id: string | null,
 *   person_id: string | null, started_at: string | null, ended_at: string | null,
 *   links: Link[], sentence: {key: string, slots: Record<string, any>} | null}} Decision
 */

/** @param {import("../main.js").App} app */
export function createDecisionPanel({ words, dialogs }) {
  const panel = /** @type {HTMLDialogElement} */ (need("#decision-panel"));
  const place = need("#decision");
  /** @type {Decision | null} */
  let shown = null;
  let asked = "";

  /** @param {string} decisionId @param {HTMLElement | null} opener */
  async function open(decisionId, opener) {
    asked = decisionId;
    shown = null;
    place.replaceChildren(make("p", "empty", words.t("decision.loading")));
    dialogs.open(panel, opener);
    const { status, decision } = await read(decisionId);
    if (asked !== decisionId) return;
    shown = decision;
    if (decision) draw();
    else
      place.replaceChildren(make("p", "empty", words.t("decision.failed", { status })));
  }

  function draw() {
    if (!shown) return;
    const { sentence } = shown;
    const head = sentence ? words.t(sentence.key, sentence.slots) : shown.kind;
    const chain = make("ol", "chain");
    chain.append(...(shown.links ?? []).map(makeLink));
    const began = shown.started_at ? words.time(shown.started_at) : "—";
    const ended = shown.ended_at
      ? `${words.t("decision.ended")} ${words.time(shown.ended_at)}`
      : words.t("decision.running");
    place.replaceChildren(
      make("p", "decision__sentence", head),
      make("small", "", `${words.t("decision.started")} ${began} · ${ended}`),
      chain,
      make("small", "", `${words.t("decision.id")} ${shown.decision_id}`),
    );
  }

  /** @param {Link} link */
  function makeLink(link) {
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
      make("p", "", saidOf(link)),
    );
    return item;
  }

  /** What a link found, with its unit. @param {Link} link */
  function saidOf({ link, value }) {
    if (value === null || value === undefined) return "";
    const key = `decision.said.${link}`;
    return typeof value === "number" && words.has(key)
      ? words.t(key, { value })
      : String(value);
  }

  words.onChange(draw);
  return { open };
}

/**
 * @param {string} decisionId
 * @returns {Promise<{status: number, decision: Decision | null}>}
 */
async function read(decisionId) {
  try {
    const answer = await fetch(`/api/v1/decisions/${encodeURIComponent(decisionId)}`);
    return { status: answer.status, decision: answer.ok ? await answer.json() : null };
  } catch {
    return { status: 0, decision: null };
  }
}
