/**
 * The Live page in the past: its map, cards and log show a recorded moment.
 *
 * STOP, the status line, alerts and the line to the server are those of now all the same:
 * only what is drawn here is given another store and another clock.
 *
 * @typedef {import("../main.js").App} App
 */

import { readApi } from "../core/api.js";
import { TIME_ZONE } from "../core/messages.js";
import { BEFORE_S, nextEvent, pastAddress } from "../core/moments.js";
import { PastLine, problemOf, waitSaid } from "../core/past_line.js";
import { PastStore } from "../core/past_store.js";
import { need, setAttribute, setHidden, setText } from "./dom.js";
import { createNotes } from "./notes.js";

const TICK_MS = 250;
const WINDOW_S = 600;
/** What is newer may not be on the disk yet (s). */
const NEWEST_S = 4;
const FAR_S = 900;
/** A picture may be awaited so long before playing falls behind its rate (s). */
const LONGEST_STEP_S = 2;
const LIVE = "/";

/**
 * @param {App} app
 * @param {number} askedS Unix time
 * @returns {App} for the panels that show the past
 */
export function createTimeTravel(app, askedS) {
  const { i18n, line } = app;
  const world = new PastStore();
  const notes = createNotes(pinOf(askedS - WINDOW_S), i18n);
  const bar = makeBar();
  const slider = /** @type {HTMLInputElement} */ (need("[data-part=slider]", bar));
  const rate = /** @type {HTMLSelectElement} */ (need("[data-part=rate]", bar));
  let targetS = askedS;
  let isPlaying = false;
  let playedAtMs = performance.now();
  let problem = "";
  /** Whether asking again may help. */
  let isTransient = false;
  const question = new PastLine(({ status, body }) => {
    if (status === 200) world.take(body);
    if (status === 200) problem = "";
    else refuse(status, body);
    draw();
  });

  /** @param {number} atS */
  function seek(atS) {
    targetS = Math.min(atS, line.serverNow() - NEWEST_S);
    history.replaceState(null, "", pastAddress(targetS));
    question.want(targetS);
    draw();
  }

  /** @param {number} status @param {any} body */
  function refuse(status, body) {
    isPlaying = false;
    isTransient = status === 0 || status >= 500;
    const ends = [body?.before, body?.after].filter(Boolean);
    const near = ends.map((at) => i18n.time(at));
    problem = i18n.t(`past.problem.${problemOf(status, body)}`, {
      before: near[0],
      after: near.at(-1),
    });
  }

  /** @param {1 | -1} way */
  async function stepEvent(way) {
    const at = await findEvent(targetS, way);
    if (at !== null) return seek(at);
    isTransient = false;
    problem = i18n.t("past.problem.no_event");
    draw();
  }

  function tick() {
    const nowMs = performance.now();
    // A slow server is waited for: what plays is what is shown.
    const isWaiting = question.waitedMs !== null;
    if (isPlaying && !isWaiting) seek(targetS + playedS(nowMs) * Number(rate.value));
    else world.freshen();
    if (!isPlaying || !isWaiting) playedAtMs = nowMs;
    drawState();
  }

  /** Time since the last picture that was asked for, but not that of a stall (s).
   * @param {number} nowMs */
  const playedS = (nowMs) => Math.min((nowMs - playedAtMs) / 1000, LONGEST_STEP_S);

  function again() {
    problem = "";
    question.again();
    drawState();
  }

  function draw() {
    const said = whenSaid(targetS, i18n.language());
    setText(need("[data-part=when]", bar), said);
    const play = need("[data-part=play]", bar);
    setText(play, i18n.t(isPlaying ? "past.pause" : "past.play"));
    setAttribute(play, "aria-pressed", String(isPlaying));
    if (document.activeElement !== slider || isPlaying) centre();
    setAttribute(slider, "aria-valuetext", said);
    notes.move(pinOf(targetS));
    drawState();
  }

  /** What is awaited, or why there is no picture, or how far one may be trusted. */
  function drawState() {
    const waitedMs = question.waitedMs;
    const wait = waitSaid(waitedMs, world.isShown);
    const waited = wait && i18n.t("past.waited", { seconds: (waitedMs ?? 0) / 1000 });
    const topics = world.leftOut.join(", ");
    const trust = topics && i18n.t("past.left_out", { topics });
    setText(need("[data-part=waited]", bar), waited);
    setText(
      need("[data-part=said]", bar),
      wait ? i18n.t(`past.${wait}`) : problem || trust,
    );
    setAttribute(bar, "data-problem", String(problem !== "" || wait === "slow"));
    const helps = wait === "slow" || (!wait && problem !== "" && isTransient);
    setHidden(need("[data-part=retry]", bar), !helps);
  }

  let middleS = askedS;

  /** The slider reaches ten minutes to both sides of where it was last let go. */
  function centre() {
    if (Math.abs(targetS - middleS) > WINDOW_S) middleS = targetS;
    slider.value = String(targetS - middleS);
  }

  /** @type {Record<string, () => void>} */
  const actions = {
    play: () => {
      isPlaying = !isPlaying;
      draw();
    },
    back: () => seek(targetS - BEFORE_S),
    on: () => seek(targetS + BEFORE_S),
    "event-back": () => void stepEvent(-1),
    "event-on": () => void stepEvent(1),
    retry: again,
  };
  for (const [part, act] of Object.entries(actions)) {
    need(`[data-part=${part}]`, bar).addEventListener("click", act);
  }
  slider.addEventListener("input", () => seek(middleS + Number(slider.value)));
  document.addEventListener("keydown", ({ key, defaultPrevented }) => {
    const isOpen = document.querySelector("dialog[open]") !== null;
    if (key === "Escape" && !isOpen && !defaultPrevented) location.assign(LIVE);
  });
  i18n.onChange(draw);
  bar.append(notes.element);
  setInterval(tick, TICK_MS);
  seek(askedS);
  const past = { serverNow: () => targetS };
  return {
    ...app,
    store: world.store,
    line: /** @type {App["line"]} */ (/** @type {any} */ (past)),
  };
}

/** What a note about a moment is pinned to. @param {number} atS Unix time */
const pinOf = (atS) => ({ at: new Date(1000 * atS).toISOString() });

/**
 * The nearest event of the log before or after a moment.
 *
 * @param {number} atS Unix time @param {1 | -1} way
 */
async function findEvent(atS, way) {
  const [from, to] = way > 0 ? [atS, atS + FAR_S] : [atS - FAR_S, atS];
  const [since, until] = [from, to].map((one) => new Date(1000 * one).toISOString());
  const range = new URLSearchParams({ since, until, limit: "500" });
  const { body } = await readApi(`log?${range}`);
  return nextEvent(body?.items ?? [], atS, way);
}

function makeBar() {
  const { content } = /** @type {HTMLTemplateElement} */ (need("#past-bar"));
  const bar = /** @type {HTMLElement} */ (
    /** @type {Element} */ (content.firstElementChild).cloneNode(true)
  );
  need(".messages").prepend(bar);
  setAttribute(document.body, "data-past", "");
  setHidden(need("#to-past"), true);
  return bar;
}

/**
 * Date, time and zone, on the greenhouse's clock as all times of the page.
 *
 * @param {number} atS Unix time
 * @param {string} language
 */
function whenSaid(atS, language) {
  return new Intl.DateTimeFormat(language === "en" ? "en-GB" : language, {
    timeZone: TIME_ZONE,
    hourCycle: "h23",
    day: "numeric",
    month: "short",
    year: "numeric",
    hour: "2-digit",
    minute: "2-digit",
    second: "2-digit",
    timeZoneName: "short",
  }).format(1000 * atS);
}
