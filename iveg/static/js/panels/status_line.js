/**
 * The status line: the worst that holds now in one sentence, the first thing on every page.
 *
 * Without the server nothing is known of any robot, and that is what it says.  What is
 * worse shows at once; what is better, and what is read aloud, has to last first.  The robot
 * that it names is one tap away on the map, from every page.
 */

import { onBeat } from "../core/beat.js";
import { fleetSaid } from "../core/fleet_said.js";
import { addressOf } from "../core/showing.js";
import { rankOf } from "../core/situation.js";
import { need, setAttribute, setText } from "./dom.js";

/** @typedef {import("../core/situation.js").Level} Level */
/** @typedef {{level: Level, rank: number, said: string, about: string,
 *   robotId: string | null}} Told `rank`: its place in the order of situations;
 *   `about`: the same while only its numbers change */
/** @typedef {import("../core/store.js").ConnectionState} ConnectionState */

const TICK_MS = 200;
const BACK_SHOWN_MS = 3000;
/** A first connection quicker than this is not worth a word (ms). */
const PATIENCE_MS = 1500;
/** More letters than this, or more lines than fit, are smaller on a phone; than that,
 * everywhere: long names of robots, and a sentence of now over a map of then. */
const LONG = 64;
const VERY_LONG = 86;
/** Smaller than this nobody reads a sentence of danger: the line grows instead (px). */
const LEAST_PX = 13;
/** From here on nothing calls for anybody. */
const LOCKED = rankOf({ kind: "locked" });
/** What lasts less than this is not told (ms). */
export const LASTS_MS = 1000;

/** @param {import("../main.js").App} app */
export function createStatusLine({ store, i18n }) {
  const place = need("#status");
  const calm = createCalm();
  let wasLost = false;
  let backAtMs = Number.NEGATIVE_INFINITY;

  function draw() {
    const { state, since } = store.connection;
    const nowMs = performance.now();
    if (state === "open" && wasLost) backAtMs = nowMs;
    if (state === "open") wasLost = false;
    if (state === "lost") wasLost = true;
    const shown = state === "connecting" && wasLost ? "lost" : state;
    const fleet = ofFleet(store, i18n, nowMs);
    const isBack = nowMs - backAtMs < BACK_SHOWN_MS && fleet.rank >= LOCKED;
    const line = ofConnection(shown, nowMs - since, isBack, i18n);
    write(calm.take(line ?? fleet, nowMs));
    setAttribute(document.body, "data-connection", state);
    drawMark(state);
  }

  /** @param {{shown: Told, aloud: Told | null}} told */
  function write({ shown, aloud }) {
    setAttribute(place, "data-level", shown.level);
    const isPast = document.body.hasAttribute("data-past");
    const said = isPast ? i18n.t("past.now", { said: shown.said }) : shown.said;
    say(said);
    if (shown.robotId) setAttribute(place, "href", addressOf(shown.robotId));
    else place.removeAttribute("href");
    if (aloud) setText(need("#status-told"), aloud.said);
  }

  /** Writes a sentence whole. @param {string} said */
  function say(said) {
    const text = need("#status-said");
    const isAsLong = text.textContent?.length === said.length;
    setText(text, said);
    place.toggleAttribute("data-very-long", said.length > VERY_LONG);
    if (!isAsLong) fit();
  }

  /**
   * Makes letters smaller, and then the line higher, until nothing is cut: whatever the
   * window, the words beside it, the reader's smallest letters.  A line that grew stays
   * so until the window changes: nothing below it moves to and fro.  Costs a layout, so
   * it is asked where the length of the sentence, its place or its letters change.
   */
  function fit() {
    const text = need("#status-said");
    const isCut = () => text.offsetHeight > place.clientHeight;
    text.style.fontSize = "";
    place.toggleAttribute("data-long", (text.textContent ?? "").length > LONG);
    if (!isCut()) return;
    place.toggleAttribute("data-long", true);
    let px = Number.parseFloat(getComputedStyle(text).fontSize);
    while (isCut() && px - 1 >= LEAST_PX) {
      px -= 1;
      text.style.fontSize = `${px}px`;
    }
    if (!isCut()) return;
    const border = place.offsetHeight - place.clientHeight;
    const high = `${text.offsetHeight + border}px`;
    document.documentElement.style.setProperty("--status", high);
  }

  function fitAnew() {
    document.documentElement.style.removeProperty("--status");
    fit();
  }

  /** @param {ConnectionState} state */
  function drawMark(state) {
    const mark = need("#mark");
    const isReplay = [...store.robots().values()].some(({ replay }) => replay);
    const isPast = document.body.hasAttribute("data-past");
    const live = isPast ? "past.mark" : isReplay ? "header.replay" : "header.live";
    const isOther = state === "open" && (isReplay || isPast);
    setAttribute(mark, "data-state", isOther ? "replay" : state);
    setText(
      need("[data-i18n]", mark),
      i18n.t(state === "lost" || state === "signed-out" ? "header.no_link" : live),
    );
  }

  measureMessages();
  store.subscribe("connection", draw);
  store.subscribe("snapshot", draw);
  i18n.onChange(draw);
  addEventListener("resize", fitAnew);
  const sizes = new ResizeObserver(fit);
  for (const part of [place, need("#status-said")]) sizes.observe(part);
  setInterval(onBeat, TICK_MS, draw);
  draw();
}

/** Panels and the drawer open below the messages, which must not be covered. */
function measureMessages() {
  const messages = need(".messages");
  new ResizeObserver(() => {
    const height = `${messages.offsetHeight}px`;
    document.documentElement.style.setProperty("--messages", height);
  }).observe(messages);
}

/**
 * What there is to say of the line to the server; null where the robots come first.
 *
 * @param {ConnectionState} state
 * @param {number} forMs how long it has been so
 * @param {boolean} isBack whether it was lost a moment ago
 * @param {import("../core/i18n.js").I18n} i18n
 * @returns {Told | null}
 */
export function ofConnection(state, forMs, isBack, i18n) {
  if (state === "signed-out") return told("danger", "banner.signed_out", i18n);
  if (state === "lost") {
    const slots = { seconds: Math.ceil(forMs / 1000) };
    return told("danger", "banner.lost", i18n, slots);
  }
  if (state === "connecting") {
    const level = forMs > PATIENCE_MS ? "doubt" : "away";
    return told(level, "banner.connecting", i18n);
  }
  return isBack ? told("away", "banner.back", i18n) : null;
}

/**
 * @param {Level} level
 * @param {string} key
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {Record<string, number>} [slots]
 * @returns {Told}
 */
const told = (level, key, i18n, slots) => ({
  level,
  // What the line to the server is like comes before every robot, or says nothing bad.
  rank: level === "away" ? Number.POSITIVE_INFINITY : -1,
  said: i18n.t(key, slots),
  about: key,
  robotId: null,
});

/**
 * @param {import("../core/store.js").Store} store
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {number} nowMs
 * @returns {Told}
 */
function ofFleet(store, i18n, nowMs) {
  const fleet = fleetSaid(store.robots().values(), i18n, nowMs);
  const { kind, robotId } = fleet;
  const { state, why } = store.robots().get(robotId ?? "")?.situation ?? {};
  const about = [kind, robotId, state, why].join(" ");
  return { ...fleet, rank: rankOf(fleet), about };
}

/**
 * Joins what flaps: what is better shows, and anything is read aloud, once it has lasted.
 */
export function createCalm() {
  /** @type {Told | null} */
  let shown = null;
  let betterSinceMs = Number.POSITIVE_INFINITY;
  let aboutSinceMs = Number.NEGATIVE_INFINITY;
  /** @type {string | null} */
  let aloud = null;

  /**
   * @param {Told} told @param {number} nowMs
   * @returns {{shown: Told, aloud: Told | null}} `aloud`: to be read out now
   */
  function take(told, nowMs) {
    const isBetter = shown !== null && told.rank > shown.rank;
    betterSinceMs = isBetter
      ? Math.min(betterSinceMs, nowMs)
      : Number.POSITIVE_INFINITY;
    if (shown === null || !isBetter || nowMs - betterSinceMs >= LASTS_MS) {
      if (shown?.about !== told.about) aboutSinceMs = nowMs;
      shown = told;
      betterSinceMs = Number.POSITIVE_INFINITY;
    }
    const isNews = aloud !== shown.about && nowMs - aboutSinceMs >= LASTS_MS;
    if (isNews) aloud = shown.about;
    return { shown, aloud: isNews ? shown : null };
  }

  return { take };
}
