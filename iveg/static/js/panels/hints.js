/**
 * Three hints for whoever opens the live page for the first time in this browser.
 *
 * They stand above the log, where nothing is pressed in haste: what they push down when
 * they come, and let up when they go, is no control of a robot.
 */

import { browserStorage } from "../map/layers/memory.js";
import { need, setHidden, setText } from "./dom.js";

const KEY = "iveg.hints";
const HINTS = /** @type {const} */ (["stop", "line", "map"]);

/**
 * @param {Pick<import("../main.js").App, "i18n">} app
 * @param {Pick<Storage, "getItem" | "setItem"> | null} [storage] tests pass their own
 */
export function createHints({ i18n }, storage = browserStorage()) {
  let shown = Number(storage?.getItem(KEY) ?? 0);

  function draw() {
    const hint = HINTS[shown];
    setHidden(need("#hints"), !hint);
    if (!hint) return;
    const place = i18n.t("hints.place", { n: shown + 1, count: HINTS.length });
    setText(need("#hints-said"), `${place} ${i18n.t(`hints.${hint}`)}`);
    const isLast = shown === HINTS.length - 1;
    setText(need("#hints-next"), i18n.t(isLast ? "hints.done" : "hints.next"));
    setHidden(need("#hints-end"), isLast);
  }

  /** @param {number} next */
  function go(next) {
    shown = next;
    try {
      storage?.setItem(KEY, String(shown));
    } catch {
      // Where nothing can be kept they come again.
    }
    draw();
  }

  need("#hints-next").addEventListener("click", () => go(shown + 1));
  need("#hints-end").addEventListener("click", () => go(HINTS.length));
  i18n.onChange(draw);
  draw();
}
