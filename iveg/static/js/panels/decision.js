/**
 * One decision from detection to observed slow-down, link by link (docs/dashboard.md): in
 * a panel over any page, and on a page of its own that can be shared and printed.
 */

import { readApi } from "../core/api.js";
import { dayAndTime, millisecondsOf } from "../pages/history/local_time.js";
import { drawDecision } from "./decision_map.js";
import { make, need } from "./dom.js";
import { createNotes } from "./notes.js";
import { readPast, spanOf } from "./past.js";
import { makePastLink } from "./past_link.js";
import { makePlots } from "./record_plots.js";
import { makeShare } from "./share.js";
import { delaysOf, makeTimeline } from "./timeline.js";

/**
 * @typedef {{link: string, at: string | number | null,
 *   value: string | number | null,
 *   verdict: "ok" | "late" | "missing" | "n/a" | "open" | "unknown"}} Link
 * @typedef {{decision_id: string, kind: string, robot_id: string | null,
 *   person_id: string | null, started_at: string | null, ended_at: string | null,
 *   class_id: string | null, speed_factor: number | null,
 *   speed_before: number | null, speed_after: number | null,
 *   rule_id: string | null, rule_version: string | null,
 *   links: Link[], sentence: {key: string, slots: Record<string, any>} | null}
 *   & import("./decision_map.js").Drawn} Decision
 */

/** @param {{i18n: import("../core/i18n.js").I18n, dialogs: any}} app */
export function createDecisionPanel({ i18n, dialogs }) {
  const panel = /** @type {HTMLDialogElement} */ (need("#decision-panel"));
  const record = createRecord(need("#decision"), i18n);

  /** @param {string} decisionId @param {HTMLElement | null} opener */
  function open(decisionId, opener) {
    dialogs.open(panel, opener);
    return record.show(decisionId);
  }

  return { open };
}

/**
 * @param {HTMLElement} place
 * @param {import("../core/i18n.js").I18n} i18n
 */
export function createRecord(place, i18n) {
  /** @type {Decision | null} */
  let shown = null;
  /** @type {import("../core/protocol.js").GreenhouseMap | null} */
  let map = null;
  /** @type {import("./past.js").Past | null} */
  let past = null;
  /** @type {ReturnType<typeof createNotes> | null} */
  let notes = null;
  let asked = "";

  /** @param {string} decisionId */
  async function show(decisionId) {
    asked = decisionId;
    shown = null;
    place.replaceChildren(make("p", "empty", i18n.t("decision.loading")));
    const path = `decisions/${encodeURIComponent(decisionId)}`;
    const [{ status, body }, greenhouse] = await Promise.all([
      readApi(path),
      map ? null : readApi("map"),
    ]);
    if (asked !== decisionId) return;
    if (greenhouse?.status === 200) map = greenhouse.body;
    const found = status === 200 ? await pastOf(body) : null;
    if (asked !== decisionId) return;
    shown = status === 200 ? body : null;
    past = found;
    notes?.element.remove();
    notes = shown?.started_at ? createNotes(pinOf(shown), i18n) : null;
    // Beside what is drawn anew, so that a note that is being written stays.
    if (notes) {
      place.after(notes.element);
      notes.element.open = true;
    }
    place.setAttribute("aria-busy", "false");
    if (shown) draw();
    else
      place.replaceChildren(make("p", "empty", i18n.t("decision.failed", { status })));
  }

  function draw() {
    if (!shown) return;
    const { sentence } = shown;
    const head = sentence ? i18n.t(sentence.key, sentence.slots) : shown.kind;
    const links = shown.links ?? [];
    const delays = delaysOf(links);
    const steps = links.map((link, i) => stepOf(link, delays[i], i18n));
    const plots = past && makePlots(past, aboutOf(shown, i18n), i18n);
    const began = momentSaid(shown.started_at);
    const ended = shown.ended_at
      ? `${i18n.t("decision.ended")} ${momentSaid(shown.ended_at)}`
      : i18n.t("decision.running");
    const picture = drawDecision(shown, map, i18n);
    place.replaceChildren(
      make("p", "decision__sentence", `${dateOf(shown)}${head}`),
      make("small", "", `${i18n.t("decision.started")} ${began} · ${ended}`),
      ...(picture ? [picture] : []),
      makeFacts(shown, i18n),
      ...(plots ? [plots] : []),
      makeTimeline(steps, i18n),
      ...(shown.started_at ? [makePastLink(shown.started_at, i18n)] : []),
      make("small", "", `${i18n.t("decision.id")} ${shown.decision_id}`),
      makeShare(
        `/decisions/${encodeURIComponent(shown.decision_id)}`,
        i18n.t("record.link_to"),
        i18n,
      ),
    );
  }

  i18n.onChange(() => {
    notes?.draw();
    draw();
  });
  return { show };
}

/** What a note about it is pinned to. @param {Decision} decision */
const pinOf = ({ started_at, robot_id, decision_id }) => ({
  at: String(started_at),
  robot_id,
  decision_id,
});

/** Date and time of day to the millisecond. @param {string | number | null} at */
function momentSaid(at) {
  if (at === null) return "—";
  const day = dayAndTime(at, { withYear: true }).split(" ")[0];
  return `${day} ${millisecondsOf(at)}`;
}

/** When it was, as the sentence to share begins. @param {Decision} decision */
function dateOf({ started_at }) {
  return started_at ? `${momentSaid(started_at)} ` : "";
}

/**
 * The observation, and the rule with its numbers at that time.
 *
 * @param {Decision} decision
 * @param {import("../core/i18n.js").I18n} i18n
 */
function makeFacts(decision, i18n) {
  const { rule_id: id, rule_version: version, rule_parameters: parameters } = decision;
  const { looks, obstacle: laser } = parameters;
  const slots = { ...parameters, ...looks, ...laser, ...decision, id, version };
  const seen = sourceOf(decision);
  const facts = [
    [`decision.fact.${seen === "told" ? "told" : "seen"}`, `decision.facts.${seen}`],
    ["decision.fact.obeys", `decision.facts.${sightOf(decision)}`],
    ...(looks?.count > 1 ? [["decision.fact.looks", "decision.facts.looks"]] : []),
    ["decision.fact.rule", `decision.facts.${laser ? "laser_rule" : "rule"}`],
  ];
  const list = make("dl", "facts");
  for (const [name, said] of facts) {
    list.append(make("dt", "", i18n.t(name)), make("dd", "", i18n.t(said, slots)));
  }
  return list;
}

/**
 * The robot's speed and its distance about that time; null where no robot is told.
 *
 * @param {Decision} decision
 */
async function pastOf({ robot_id, person_id, started_at, ended_at }) {
  if (!robot_id || !started_at) return null;
  return readPast(spanOf(started_at, ended_at), robot_id, person_id);
}

/** @param {Decision} decision @param {import("../core/i18n.js").I18n} i18n */
function aboutOf({ started_at, ended_at, rule_parameters, ...told }, i18n) {
  const { speed_before: before, speed_after: after } = told;
  const known = [before, after].every((speed) => speed !== null);
  const since = Date.parse(String(started_at));
  const until = ended_at === null ? Number.POSITIVE_INFINITY : Date.parse(ended_at);
  return {
    shade: { since, until, name: i18n.t("plot.key.decision") },
    radiusM: rule_parameters.radius_m ?? null,
    speedSaid: known ? i18n.t("plot.before_after", { before, after }) : "",
  };
}

/** How its cause is known. @param {Decision} decision */
function sourceOf({ class_id, rule_parameters }) {
  if (rule_parameters.obstacle) return "laser";
  if (class_id === null) return "told";
  return class_id === "laser" ? "walker" : "seen";
}

/** @param {Decision} decision */
function sightOf({ in_sight }) {
  return in_sight === false ? "obeys_blind" : "obeys";
}

/**
 * @param {Link} link
 * @param {number | null} delayMs
 * @param {import("../core/i18n.js").I18n} i18n
 * @returns {import("./timeline.js").Step}
 */
function stepOf(link, delayMs, i18n) {
  const key = `decision.link.${link.link}`;
  return {
    name: i18n.has(key) ? i18n.t(key) : link.link,
    at: link.at,
    verdict: link.verdict,
    state: i18n.t(`decision.verdict.${link.verdict}`),
    took: delayMs === null ? "" : delaySaid(delayMs, i18n),
    said: saidOf(link, i18n),
  };
}

/** A robot may have known before it was told. @param {number} ms
 * @param {import("../core/i18n.js").I18n} i18n */
function delaySaid(ms, i18n) {
  const key = ms < 0 ? "decision.delay_before" : "decision.delay";
  return i18n.t(key, { ms: Math.abs(ms) });
}

/** What a link found, with its unit. @param {Link} link
 * @param {import("../core/i18n.js").I18n} i18n */
function saidOf({ link, value }, i18n) {
  if (value === null || value === undefined) return "";
  const key = `decision.said.${link}`;
  const isMeasured = link === "detection" || typeof value === "number";
  return isMeasured && i18n.has(key) ? i18n.t(key, { value }) : String(value);
}
