/**
 * The Climate page: three readings, their age, and their last 24 hours.
 *
 * @typedef {"temperature" | "humidity" | "co2"} Part
 * @typedef {import("./history/charts.js").Source & {since: string, until: string,
 *   slice_s: number, figures: Record<Part, import("./history/charts.js").Figure>}} Day
 */

import { readApi } from "../core/api.js";
import { ageOf } from "../core/clock.js";
import { CLIMATE_OLD_S, climateAgo } from "../panels/climate_texts.js";
import { need, setAttribute, setHidden, setText } from "../panels/dom.js";
import { onThemeChange } from "../panels/theme.js";
import { startEquipment } from "./equipment.js";
import { drawFigure } from "./history/charts.js";

/** @type {readonly Part[]} */
const PARTS = ["temperature", "humidity", "co2"];
const TICK_MS = 1000;
/** As often as history keeps a reading. */
const DAY_MS = 60_000;

/** @param {import("../core/page.js").Page} page */
export function start(page) {
  const { store, i18n } = page;
  const day = createDay(i18n);
  startEquipment(page);

  function draw() {
    /** @type {import("../core/protocol.js").Climate | null} */
    const climate = store.get("climate") ?? null;
    const age = climate ? ageOf(climate) : Number.POSITIVE_INFINITY;
    const isOld = age > CLIMATE_OLD_S || store.connection.state !== "open";
    tile("temperature", climate?.temperature, age);
    tile("humidity", climate?.relative_humidity, age);
    tile("co2", climate?.co2, age);
    need("#climate-page").toggleAttribute("data-old", isOld);
    const state = climate ? (isOld ? "late" : "ok") : "unknown";
    setAttribute(need("#climate-says"), "data-state", state);
    setText(need("#climate-sentence"), sentence(age, isOld));
  }

  /** @param {Part} part @param {number | null | undefined} value @param {number} age */
  function tile(part, value, age) {
    const isKnown = typeof value === "number";
    const said = isKnown ? i18n.t(`climate.tile.${part}`, { value }) : "—";
    setText(need(`#climate-${part}`), said);
    setText(need(`#climate-${part}-age`), isKnown ? climateAgo(age, i18n) : "");
  }

  /** @param {number} age (s) @param {boolean} isOld */
  function sentence(age, isOld) {
    if (!Number.isFinite(age)) return i18n.t("climate.waiting");
    // Without seconds: this line is read out whenever it changes.
    return i18n.t(isOld ? "climate.old" : "climate.fresh", {
      ago: climateAgo(age, i18n),
    });
  }

  store.subscribe("climate", draw);
  store.subscribe("connection", draw);
  store.subscribe("snapshot", day.load);
  i18n.onChange(draw);
  setInterval(draw, TICK_MS);
  draw();
  day.load();
}

/**
 * The last 24 hours, asked for again each minute while the page is visible.
 *
 * @param {import("../core/i18n.js").I18n} i18n
 */
function createDay(i18n) {
  /** @type {Day | null} */
  let day = null;
  let status = 200;
  let isBare = false;

  async function load() {
    if (document.hidden) return;
    const answer = await readApi("history/climate");
    status = answer.status;
    // The figures stay when the server is gone: the past stays true.
    if (status === 200) day = answer.body;
    await draw();
  }

  async function draw() {
    setHidden(need("#trend-error"), status === 200 && !isBare);
    const wrong = status ? "rows.failed" : "rows.offline";
    const why = isBare ? "history.error.library" : wrong;
    setText(need("#trend-error"), i18n.t(why, { status }));
    if (day === null) return;
    const heard = PARTS.filter((part) => day?.figures[part].data.length);
    setHidden(need("#trend-empty"), heard.length > 0);
    setHidden(need("#trends"), heard.length === 0);
    setText(need("#trend-note"), heard.length ? noteOf(day) : "");
    for (const part of PARTS) await drawPart(part, day);
  }

  /** @param {Day} shown */
  function noteOf({ slice_s }) {
    const minutes = slice_s / 60;
    return i18n.t(`climate.note.${slice_s ? "sliced" : "exact"}`, { minutes });
  }

  /** @param {Part} part @param {Day} shown */
  async function drawPart(part, shown) {
    const figure = shown.figures[part];
    const place = need(`#trend-${part}`);
    setHidden(place, figure.data.length === 0);
    setText(need(`#trend-${part}-says`), spreadOf(part, figure));
    if (figure.data.length === 0) return;
    const span = { since: Date.parse(shown.since), until: Date.parse(shown.until) };
    try {
      await drawFigure(place, figure, shown, span, i18n);
      isBare = false;
    } catch {
      isBare = true;
      setHidden(need("#trend-error"), false);
      setText(need("#trend-error"), i18n.t("history.error.library"));
    }
  }

  /**
   * Least and greatest of the day: the text alternative of the line.
   *
   * @param {Part} part @param {import("./history/charts.js").Figure} figure
   */
  function spreadOf(part, { data }) {
    const [trace] = data;
    if (!trace) return i18n.t("climate.silent");
    const values = trace.y.filter((value) => value !== null);
    const share = part === "humidity" ? 0.01 : 1;
    const say = (/** @type {number} */ value) =>
      i18n.t(`climate.tile.${part}`, { value: value * share });
    const [least, most] = [Math.min(...values), Math.max(...values)];
    return i18n.t("climate.spread", { least: say(least), most: say(most) });
  }

  setInterval(load, DAY_MS);
  document.addEventListener("visibilitychange", load);
  i18n.onChange(draw);
  onThemeChange(draw);
  return { load };
}
