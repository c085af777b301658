/**
 * Moments with their ages, which grow while the page is open.
 */

import { all, make, need, setText } from "../panels/dom.js";
import { dayAndTime } from "./history/local_time.js";

const EVERY_MS = 1000;
const FRESH_MS = 10_000;

/** @param {import("../core/page.js").Page} page */
export function createAges({ line, i18n }) {
  /** @param {HTMLElement} cell */
  function draw(cell) {
    const at = String(cell.dataset.ages);
    const age = Math.max(0, line.serverNow() - Date.parse(at) / 1000);
    setText(cell, i18n.t("rows.aged", { at: dayAndTime(at), age }));
  }

  setInterval(() => all("[data-ages]").forEach(draw), EVERY_MS);
  /** A cell of a table. @param {string} at ISO-8601 */
  return function cell(at) {
    const made = make("td", "time named");
    made.dataset.ages = at;
    draw(made);
    return made;
  };
}

/**
 * Reads a list anew again and again, but not under the finger of who works in it.
 *
 * @param {string} name of `_rows.html`
 * @param {() => void} load
 */
export function keepFresh(name, load) {
  const body = need(`#${name}-rows`);
  setInterval(() => body.contains(document.activeElement) || load(), FRESH_MS);
}
