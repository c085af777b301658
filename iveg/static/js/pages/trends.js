/**
 * The last 24 hours of what the history keeps each minute, as figures: asked for again
 * while the page is visible, and drawn anew in another language or theme.
 *
 * @typedef {import("./history/charts.js").Figure} Figure
 * @typedef {{since: string, until: string}} Day
 * @typedef {import("../core/i18n.js").I18n} I18n
 */

import { readApi } from "../core/api.js";
import { need, setHidden, setText } from "../panels/dom.js";
import { onThemeChange } from "../panels/theme.js";
import { drawFigure } from "./history/charts.js";

/** As often as the history keeps a number. */
const DAY_MS = 60_000;

/**
 * @template {Day} T
 * @param {{path: string, error: string, isAsked?: () => boolean,
 *   show: (day: T) => {place: HTMLElement, figure: Figure}[]}} options `error` where
 *   it is said what is wrong; `show` writes the texts and tells what is to be drawn
 * @param {I18n} i18n
 */
export function createTrends({ path, error, isAsked = () => true, show }, i18n) {
  /** @type {T | null} */
  let day = null;
  let status = 200;
  let isBare = false;

  async function load() {
    if (document.hidden || !isAsked()) return;
    const answer = await readApi(path);
    status = answer.status;
    // The figures stay when the server is gone: the past stays true.
    if (status === 200) day = answer.body;
    await draw();
  }

  async function draw() {
    if (day !== null) {
      const figures = show(day);
      isBare = !(await areDrawn(figures, day, i18n));
    }
    setHidden(need(error), status === 200 && !isBare);
    const wrong = status ? "rows.failed" : "rows.offline";
    const why = isBare ? "history.error.library" : wrong;
    setText(need(error), i18n.t(why, { status }));
  }

  setInterval(load, DAY_MS);
  document.addEventListener("visibilitychange", load);
  i18n.onChange(draw);
  onThemeChange(draw);
  return { load };
}

/**
 * Draws one after the other; false where the library cannot be loaded.
 *
 * @param {{place: HTMLElement, figure: Figure}[]} figures
 * @param {Day} day @param {I18n} i18n
 */
async function areDrawn(figures, day, i18n) {
  const span = { since: Date.parse(day.since), until: Date.parse(day.until) };
  try {
    for (const { place, figure } of figures)
      await drawFigure(place, figure, span, i18n);
    return true;
  } catch {
    return false;
  }
}

/**
 * Least and greatest of a line: its text alternative.
 *
 * @param {Figure} figure
 * @param {(value: number) => string} say
 * @param {I18n} i18n
 */
export function spreadSaid({ data: [line] }, say, i18n) {
  if (!line) return i18n.t("climate.silent");
  const values = line.y.filter((value) => value !== null);
  const [least, most] = [Math.min(...values), Math.max(...values)];
  return i18n.t("climate.spread", { least: say(least), most: say(most) });
}
