/**
 * Other equipment on the Climate page: its tiles, and the last 24 hours of each.
 *
 * @typedef {import("../core/protocol.js").Tile} Tile
 * @typedef {import("./history/charts.js").Figure} Figure
 * @typedef {import("./trends.js").Day & {figures: Record<string, Figure>}} Day by tile
 */

import { ageOf } from "../core/clock.js";
import { climateAgo } from "../panels/climate_texts.js";
import {
  fill,
  make,
  need,
  needPart,
  setAttribute,
  setHidden,
  setText,
} from "../panels/dom.js";
import { createTrends, spreadSaid } from "./trends.js";

const TICK_MS = 1000;
const UNKNOWN = new Set(["waiting", "silent", "unreadable"]);

/** @param {import("../core/page.js").Page} page */
export function startEquipment({ store, i18n }) {
  const tiles = () => /** @type {Tile[]} */ (store.get("equipment") ?? []);
  const day = createDay(tiles, i18n);

  function draw() {
    const isOpen = store.connection.state === "open";
    setHidden(need("#equipment"), tiles().length === 0);
    fill(need("#equipment-tiles"), tiles(), makeTile, (child, tile) =>
      writeTile(child, tile, isOpen, i18n),
    );
  }

  store.subscribe("equipment", draw);
  store.subscribe("connection", draw);
  store.subscribe("snapshot", day.load);
  i18n.onChange(draw);
  setInterval(draw, TICK_MS);
  draw();
  day.load();
}

function makeTile() {
  const tile = make("div", "tile");
  const parts = [make("dt", ""), make("dd", ""), make("dd", "tile__age")];
  for (const [index, name] of ["name", "value", "state"].entries())
    parts[index].dataset.part = name;
  tile.append(...parts);
  return tile;
}

/**
 * @param {Element} child
 * @param {Tile} tile
 * @param {boolean} isOpen whether this screen hears the server
 * @param {import("../core/i18n.js").I18n} i18n
 */
function writeTile(child, tile, isOpen, i18n) {
  setText(needPart("name", child), tile.name[i18n.language()]);
  setText(needPart("value", child), numberSaid(tile, i18n));
  setText(needPart("state", child), stateOf(tile, i18n));
  setAttribute(child, "data-state", tile.state);
  child.toggleAttribute("data-old", !isOpen || UNKNOWN.has(tile.state));
}

/** @param {Tile} tile @param {import("../core/i18n.js").I18n} i18n */
function numberSaid({ value, decimals, unit }, i18n) {
  if (value === null) return "—";
  return `${i18n.number(value, decimals)} ${shown(unit)}`.trim();
}

/** A unit as it stands after a number; of a plain number nothing. @param {string} unit */
const shown = (unit) => (unit === "1" ? "" : unit);

/** @param {Tile} tile @param {import("../core/i18n.js").I18n} i18n */
function stateOf(tile, i18n) {
  const { state, limits } = tile;
  const isNever = tile.value === null && state !== "waiting";
  const ago = climateAgo(ageOf(tile), i18n);
  const limit = limits[/** @type {keyof typeof limits} */ (state)];
  const key = isNever ? `${state}_never` : state;
  return i18n.t(`climate.state.${key}`, { ago, limit, unit: shown(tile.unit) });
}

/**
 * @param {() => Tile[]} tiles
 * @param {import("../core/i18n.js").I18n} i18n
 */
function createDay(tiles, i18n) {
  /** @param {Day} day */
  function show({ figures }) {
    const drawn = tiles().filter(({ trend, key }) => trend && figures[key]);
    setHidden(need("#equipment-day"), drawn.length === 0);
    const place = need("#equipment-trends");
    fill(place, drawn, makeTrend, (child, tile) =>
      writeTrend(child, tile, figures[tile.key], i18n),
    );
    return drawn.map((tile, index) => ({
      place: needPart("figure", place.children[index]),
      figure: inUnit(figures[tile.key], shown(tile.unit)),
    }));
  }
  const isAsked = () => tiles().length > 0;
  return createTrends(
    { path: "history/equipment", error: "#equipment-error", isAsked, show },
    i18n,
  );
}

/**
 * @param {Element} child @param {Tile} tile @param {Figure} figure
 * @param {import("../core/i18n.js").I18n} i18n
 */
function writeTrend(child, tile, figure, i18n) {
  const name = tile.name[i18n.language()];
  const say = (/** @type {number} */ value) => numberSaid({ ...tile, value }, i18n);
  const spread = spreadSaid(figure, say, i18n);
  setText(needPart("name", child), name);
  setText(needPart("says", child), spread);
  setAttribute(needPart("figure", child), "aria-label", `${name}. ${spread}`);
}

/** With the unit on the axis. @param {Figure} figure @param {string} unit */
function inUnit(figure, unit) {
  const yaxis = { ...figure.layout.yaxis, title: { text: unit, standoff: 8 } };
  return { ...figure, layout: { ...figure.layout, yaxis } };
}

function makeTrend() {
  const trend = make("section", "trend");
  const parts = [make("h3", ""), make("div", "chart__place"), make("p", "chart__note")];
  for (const [index, name] of ["name", "figure", "says"].entries())
    parts[index].dataset.part = name;
  parts[1].setAttribute("role", "img");
  trend.append(...parts);
  return trend;
}
