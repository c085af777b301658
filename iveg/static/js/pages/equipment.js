/**
 * Other equipment on the Climate page: its tiles, and the last 24 hours of each.
 *
 * @typedef {import("../core/protocol.js").Tile} Tile
 * @typedef {import("./history/charts.js").Source & {since: string, until: string,
 *   figures: Record<string, import("./history/charts.js").Figure>}} Day by tile
 */

import { readApi } from "../core/api.js";
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
import { onThemeChange } from "../panels/theme.js";
import { drawFigure } from "./history/charts.js";

const TICK_MS = 1000;
/** As often as the history keeps a number. */
const DAY_MS = 60_000;
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
 * The last 24 hours, asked for again each minute while the page is visible.
 *
 * @param {() => Tile[]} tiles
 * @param {import("../core/i18n.js").I18n} i18n
 */
function createDay(tiles, i18n) {
  /** @type {Day | null} */
  let day = null;
  let status = 200;

  async function load() {
    if (document.hidden || tiles().length === 0) return;
    const answer = await readApi("history/equipment");
    status = answer.status;
    // The figures stay when the server is gone: the past stays true.
    if (status === 200) day = answer.body;
    await draw();
  }

  async function draw() {
    setHidden(need("#equipment-error"), status === 200);
    const wrong = status ? "rows.failed" : "rows.offline";
    setText(need("#equipment-error"), i18n.t(wrong, { status }));
    if (day === null) return;
    const { figures } = day;
    const drawn = tiles().filter(({ trend, key }) => trend && figures[key]);
    setHidden(need("#equipment-day"), drawn.length === 0);
    const place = need("#equipment-trends");
    fill(place, drawn, makeTrend, (child, tile) =>
      setText(needPart("name", child), tile.name[i18n.language()]),
    );
    for (const [index, tile] of drawn.entries())
      await drawTrend(place.children[index], tile, day);
  }

  /** @param {Element} child @param {Tile} tile @param {Day} shownDay */
  async function drawTrend(child, tile, shownDay) {
    const figure = shownDay.figures[tile.key];
    const place = needPart("figure", child);
    const spread = spreadOf(tile, figure);
    setText(needPart("says", child), spread);
    setAttribute(place, "aria-label", `${tile.name[i18n.language()]}. ${spread}`);
    const span = {
      since: Date.parse(shownDay.since),
      until: Date.parse(shownDay.until),
    };
    const unit = { title: { text: shown(tile.unit), standoff: 8 } };
    const yaxis = { ...figure.layout.yaxis, ...unit };
    const own = { ...figure, layout: { ...figure.layout, yaxis } };
    try {
      await drawFigure(place, own, shownDay, span, i18n);
    } catch {
      setHidden(need("#equipment-error"), false);
      setText(need("#equipment-error"), i18n.t("history.error.library"));
    }
  }

  /**
   * Least and greatest of the day: the text alternative of the line.
   *
   * @param {Tile} tile @param {import("./history/charts.js").Figure} figure
   */
  function spreadOf(tile, { data }) {
    const values = data[0].y.filter((value) => value !== null);
    const say = (/** @type {number} */ value) => numberSaid({ ...tile, value }, i18n);
    const [least, most] = [Math.min(...values), Math.max(...values)];
    return i18n.t("climate.spread", { least: say(least), most: say(most) });
  }

  setInterval(load, DAY_MS);
  document.addEventListener("visibilitychange", load);
  i18n.onChange(draw);
  onThemeChange(draw);
  return { load };
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
