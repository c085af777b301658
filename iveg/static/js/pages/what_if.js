/**
 * Another rule: what it would have done over a range that is past, and the trial of one
 * beside the rule in force.
 *
 * @typedef {import("../core/protocol.js").Rule} Rule
 * @typedef {import("../types.js").WhatIf} WhatIf
 * @typedef {import("../types.js").TriedOutcome} Outcome
 */

import { readApi, sendApi } from "../core/api.js";
import { make, need, setHidden, setText } from "../panels/dom.js";
import { onThemeChange } from "../panels/theme.js";
import { drawFigure } from "./history/charts.js";
import { personShare } from "./lowering.js";
import { endQuestion, failureKey, isGoing, lookAgain, refusalKey } from "./question.js";
import { startTrial } from "./trial.js";

const HOUR_MS = 3_600_000;
/** Shares are typed in percent. */
const SHARES = new Set(["confidence_threshold", "factor"]);
const PARTS = /** @type {const} */ ([
  "confidence_threshold",
  "radius_m",
  "foresight_s",
  "release_beyond_m",
  "release_after_s",
  "factor",
]);
const FIGURES = /** @type {const} */ (["minutes", "near_misses", "truth"]);

/** @param {import("../core/page.js").Page} page */
export function start({ store, i18n }) {
  let isFilled = false;
  /** @type {WhatIf | null} */
  let asked = null;
  /** @type {any} */
  let figures = null;
  let said = "";

  function fill() {
    /** @type {Rule | undefined} */
    const rule = store.get("rule");
    if (!rule || isFilled) return;
    isFilled = true;
    for (const [name, value] of Object.entries(inForce(rule)))
      input(name).value = shown(name, value);
  }

  /** @param {SubmitEvent} event */
  async function ask(event) {
    event.preventDefault();
    const now = Date.now();
    const hours = Number(
      /** @type {HTMLSelectElement} */ (need("#whatif-hours")).value,
    );
    const { status, body } = await sendApi("POST", "what-if", {
      ...typed(),
      since: new Date(now - hours * HOUR_MS).toISOString(),
      // The newest rows are still on their way to the history.
      until: new Date(now - 10_000).toISOString(),
      vary: /** @type {HTMLSelectElement} */ (need("#whatif-vary")).value,
    });
    if (status !== 202) return say(refusal(status, body));
    asked = body;
    figures = null;
    await follow();
  }

  async function follow() {
    while (asked && isGoing(asked)) {
      draw();
      const { status, body } = await lookAgain(asked);
      if (status === 200) asked = body;
      else if (status === 404) asked = null;
      // The first hours have a curve already, which grows.
      if (asked?.answer) await readFigures(asked.id);
    }
    draw();
  }

  /** @param {string} id */
  async function readFigures(id) {
    const { status, body } = await readApi(`what-if/${id}/figures`);
    if (status === 200) figures = body;
  }

  async function cancel() {
    if (asked) await endQuestion(asked);
  }

  /** @param {string} text */
  function say(text) {
    said = text;
    setText(need("#whatif-result"), text);
  }

  function draw() {
    const isAwaited = isGoing(asked);
    setHidden(need("#whatif-cancel"), !isAwaited);
    setHidden(need("#whatif-progress"), !isAwaited);
    /** @type {HTMLButtonElement} */ (need("#whatif-ask")).disabled = isAwaited;
    /** @type {HTMLProgressElement} */ (need("#whatif-progress")).value =
      asked?.progress ?? 0;
    say(asked ? stateSaid(asked, i18n) : said);
    // The first hours may have nothing.
    setHidden(need("#whatif-answer"), !asked?.answer?.poses);
    if (asked?.answer?.poses) drawAnswer(asked);
  }

  /** @param {WhatIf} found */
  async function drawAnswer({ answer, since, until }) {
    if (!answer) return;
    const { poses, detections } = answer;
    const span = { since: Date.parse(since), until: Date.parse(until) };
    setText(need("#whatif-rests"), i18n.t("whatif.rests", { poses, detections }));
    need("#whatif-rows").replaceChildren(...rowsOf(answer, i18n));
    if (!figures) return;
    setHidden(need("#whatif-truth-section"), !figures.figures.truth);
    for (const name of FIGURES.filter((one) => one in figures.figures))
      await drawFigure(
        need(`#whatif-${name}`),
        figures.figures[name],
        figures,
        span,
        i18n,
      );
  }

  /** @param {number} status @param {any} body */
  function refusal(status, body) {
    const key = refusalKey(status, body);
    return i18n.t(key ?? "rule.refused", { why: String(body?.detail ?? status) });
  }

  need("#whatif-form").addEventListener("submit", (event) =>
    ask(/** @type {SubmitEvent} */ (event)),
  );
  // A browser cannot point to what is folded away: it would do nothing, silently.
  need("#whatif-form").addEventListener("invalid", unfold, true);
  need("#whatif-cancel").addEventListener("click", cancel);
  store.subscribe("rule", fill);
  i18n.onChange(draw);
  onThemeChange(draw);
  fill();
  startTrial(store, i18n, typed);
}

/** @param {Event} event */
function unfold({ target }) {
  /** @type {Element} */ (target).closest("details")?.setAttribute("open", "");
}

/** What the form says, as the API takes it. */
function typed() {
  return Object.fromEntries(
    PARTS.map((name) => {
      const value = input(name).valueAsNumber;
      return [name, SHARES.has(name) ? value / 100 : value];
    }),
  );
}

/** @param {Rule} rule @returns {Record<string, number>} */
function inForce(rule) {
  return {
    confidence_threshold: personShare(rule),
    radius_m: rule.radius_m,
    foresight_s: rule.foresight_s,
    release_beyond_m: 0.3,
    release_after_s: 1,
    factor: rule.factor,
  };
}

/** @param {string} name @param {number} value */
const shown = (name, value) =>
  String(SHARES.has(name) ? Math.round(value * 100) : value);

/** @param {string} name */
function input(name) {
  return /** @type {HTMLInputElement} */ (need(`#whatif-${name}`));
}

/** @param {WhatIf} asked @param {import("../core/i18n.js").I18n} i18n */
export function stateSaid({ state, progress, why }, i18n) {
  if (state !== "failed")
    return i18n.t(`whatif.state.${state}`, { percent: Math.round(progress * 100) });
  return i18n.t(failureKey(why));
}

/**
 * One row a number: as it was decided, by the rule in force, by the candidate.
 *
 * @param {import("../types.js").WhatIfAnswer} answer
 * @param {import("../core/i18n.js").I18n} i18n
 */
function rowsOf(answer, i18n) {
  const { in_force, candidate, recorded_slowed_s, recorded_encounters } = answer;
  const minutes = (/** @type {number | undefined} */ s) =>
    i18n.number((s ?? 0) / 60, 1);
  const count = (/** @type {number | undefined} */ n) => i18n.number(n ?? 0, 0);
  const row = (
    /** @type {string} */ key,
    /** @type {string | null} */ was,
    /** @type {(one: Outcome) => string} */ read,
  ) => [i18n.t(`whatif.row.${key}`), was ?? "—", read(in_force), read(candidate)];
  const rows = [
    row("person_min", minutes(recorded_slowed_s.person), (one) =>
      minutes(one.slowed_s.person),
    ),
    row("robot_min", minutes(recorded_slowed_s.robot), (one) =>
      minutes(one.slowed_s.robot),
    ),
    row("person_count", count(recorded_encounters.person), (one) =>
      count(one.encounters.person),
    ),
    row("robot_count", count(recorded_encounters.robot), (one) =>
      count(one.encounters.robot),
    ),
    row("near_misses", null, (one) => count(one.near_misses)),
    row("lost_min", null, (one) => minutes(one.lost_s)),
  ];
  // Against the truth, where there is one.
  if (in_force.missed_s !== null)
    rows.push(
      row("missed_min", null, (one) => minutes(one.missed_s ?? 0)),
      row("false_min", null, (one) => minutes(one.false_s ?? 0)),
    );
  return rows.map(([head, ...cells]) => {
    const line = make("tr");
    const th = make("th", "", head);
    th.scope = "row";
    line.append(th, ...cells.map((cell) => make("td", "number", cell)));
    return line;
  });
}
