/**
 * The Climate page: three readings, their age, and their last 24 hours.
 *
 * @typedef {"temperature" | "humidity" | "co2"} Part
 * @typedef {import("./trends.js").Day & {
 *   figures: Record<Part, import("./history/charts.js").Figure>}} Day
 */

import { ageOf } from "../core/clock.js";
import { CLIMATE_OLD_S, climateAgo } from "../panels/climate_texts.js";
import { need, setAttribute, setHidden, setText } from "../panels/dom.js";
import { startEquipment } from "./equipment.js";
import { createTrends, spreadSaid } from "./trends.js";

/** @type {readonly Part[]} */
const PARTS = ["temperature", "humidity", "co2"];
const TICK_MS = 1000;

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

/** @param {import("../core/i18n.js").I18n} i18n */
function createDay(i18n) {
  /** @param {Day} day */
  function show(day) {
    const heard = PARTS.filter((part) => day.figures[part].data.length);
    setHidden(need("#trend-empty"), heard.length > 0);
    setHidden(need("#trends"), heard.length === 0);
    setText(need("#trend-note"), heard.length ? noteOf(day.figures[heard[0]]) : "");
    for (const part of PARTS) {
      const figure = day.figures[part];
      setHidden(need(`#trend-${part}`), figure.data.length === 0);
      setText(need(`#trend-${part}-says`), spreadOf(part, figure));
    }
    return heard.map((part) => ({
      place: need(`#trend-${part}`),
      figure: day.figures[part],
    }));
  }

  /** @param {import("./history/charts.js").Figure} figure */
  function noteOf({ data: [line] }) {
    return i18n.t("climate.note", { minutes: line.meta.slice_s / 60 });
  }

  /** @param {Part} part @param {import("./history/charts.js").Figure} figure */
  function spreadOf(part, figure) {
    const share = part === "humidity" ? 0.01 : 1;
    const say = (/** @type {number} */ value) =>
      i18n.t(`climate.tile.${part}`, { value: value * share });
    return spreadSaid(figure, say, i18n);
  }

  return createTrends({ path: "history/climate", error: "#trend-error", show }, i18n);
}
