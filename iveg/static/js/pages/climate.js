/**
 * The Climate page: three numbers to read from afar, and how old they are.
 */

import { ageOf } from "../clock.js";
import { need, setAttribute, setText } from "../panels/dom.js";

const TICK_MS = 1000;
/** Air changes slowly; after five minutes a reading still says little of now (s). */
const OLD_S = 300;

/** @param {import("../page.js").Page} page */
export function start({ store, words }) {
  function draw() {
    /** @type {import("../protocol.js").Climate | null} */
    const climate = store.get("climate") ?? null;
    const age = climate ? ageOf(climate) : Number.POSITIVE_INFINITY;
    const isOld = age > OLD_S || store.connection.state !== "open";
    tile("temperature", climate?.temperature);
    tile("humidity", climate?.relative_humidity);
    tile("co2", climate?.co2);
    need("#climate-page").toggleAttribute("data-old", isOld);
    const state = climate ? (isOld ? "late" : "ok") : "unknown";
    setAttribute(need("#climate-says"), "data-state", state);
    setText(need("#climate-sentence"), sentence(age, isOld));
  }

  /** @param {string} part @param {number | null | undefined} value */
  function tile(part, value) {
    const said =
      typeof value === "number" ? words.t(`climate.${part}`, { value }) : "—";
    setText(need(`#climate-${part}`), said);
  }

  /** @param {number} age (s) @param {boolean} isOld */
  function sentence(age, isOld) {
    if (!Number.isFinite(age)) return words.t("climate.waiting");
    return words.t(isOld ? "climate.old" : "climate.fresh", { age });
  }

  store.subscribe("climate", draw);
  store.subscribe("connection", draw);
  words.onChange(draw);
  setInterval(draw, TICK_MS);
  draw();
}
