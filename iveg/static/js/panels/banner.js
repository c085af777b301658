/**
 * The banner of a lost connection: old data must never look like new data.
 */

import { onBeat } from "../core/beat.js";
import { need, setAttribute, setHidden, setText } from "./dom.js";

const TICK_MS = 250;
const BACK_SHOWN_MS = 3000;
/** A first connection quicker than this needs no banner (ms). */
const PATIENCE_MS = 1500;

/** @param {import("../main.js").App} app */
export function createBanner({ store, i18n }) {
  const banner = need("#banner");
  const mark = need("#mark");
  let wasLost = false;
  let backAtMs = Number.NEGATIVE_INFINITY;

  function draw() {
    const { state, since } = store.connection;
    const nowMs = performance.now();
    if (state === "open" && wasLost) backAtMs = nowMs;
    if (state === "open") wasLost = false;
    if (state === "lost") wasLost = true;
    const sentence = sentenceOf(state, nowMs - since, nowMs - backAtMs);
    setHidden(banner, sentence === null);
    setText(banner, sentence ?? "");
    setAttribute(banner, "data-state", state);
    setAttribute(document.body, "data-connection", state);
    drawMark(state);
  }

  /**
   * @param {import("../core/store.js").ConnectionState} state
   * @param {number} forMs
   * @param {number} backMs
   */
  function sentenceOf(state, forMs, backMs) {
    if (state === "signed-out") return i18n.t("banner.signed_out");
    if (state === "lost" || (state === "connecting" && wasLost)) {
      return i18n.t("banner.lost", { seconds: Math.ceil(forMs / 1000) });
    }
    if (state === "connecting" && forMs > PATIENCE_MS)
      return i18n.t("banner.connecting");
    return backMs < BACK_SHOWN_MS ? i18n.t("banner.back") : null;
  }

  /** @param {string} state */
  function drawMark(state) {
    const isReplay = [...store.robots().values()].some(({ replay }) => replay);
    const live = isReplay ? "header.replay" : "header.live";
    setAttribute(mark, "data-state", state === "open" && isReplay ? "replay" : state);
    setText(
      need("[data-i18n]", mark),
      i18n.t(state === "lost" || state === "signed-out" ? "header.no_link" : live),
    );
  }

  const messages = need(".messages");
  new ResizeObserver(() => {
    // Panels and the drawer open below the messages, which must not be covered.
    const height = `${messages.offsetHeight}px`;
    document.documentElement.style.setProperty("--messages", height);
  }).observe(messages);
  store.subscribe("connection", draw);
  i18n.onChange(draw);
  setInterval(onBeat, TICK_MS, draw);
  draw();
}
