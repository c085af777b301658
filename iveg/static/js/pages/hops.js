/**
 * The Latency page: the paper's table with live values beside the printed ones, and how
 * the times of each hop are distributed.
 *
 * @typedef {import("../types.js").SegmentSpread} Spread
 * @typedef {import("../core/i18n.js").I18n} I18n
 * @typedef {import("../types.js").LatencyTable & {
 *   figures: Record<string, import("./hop_figures.js").Figure>,
 * }} Latency
 */

import { readApi } from "../core/api.js";
import { all, make, need, setAttribute, setHidden, setText } from "../panels/dom.js";
import { onThemeChange } from "../panels/theme.js";
import { drawHopFigure } from "./hop_figures.js";

const EVERY_MS = 2000;
/** The figure costs the server more than numbers: every fifth time. */
const DRAW_EVERY = 5;
const HOPS = ["uplink", "fiware", "robot_orion", "iveg", "screen"];
const NOTHING = "—";
/** The paper's name of each hop; it has none for the hops after Orion. */
const PRINTED = /** @type {Record<string, string>} */ ({
  uplink: "uplink",
  fiware: "fiware",
  robot_orion: "total",
});

/** @param {import("../core/page.js").Page} page */
export function start({ i18n }) {
  let robot = "";
  /** @type {Latency | null} */
  let told = null;
  let status = 200;
  let times = 0;

  async function load() {
    if (document.hidden) return;
    const query = queryOf(robot);
    const draws = times % DRAW_EVERY === 0;
    times += 1;
    const answer = await readApi(`latency?${query}&figures=${draws}`);
    if (query !== queryOf(robot)) return;
    status = answer.status;
    if (status === 200) told = answer.body;
    await draw();
  }

  async function draw() {
    const failed = need("#hops-error");
    setHidden(failed, status === 200);
    setText(failed, i18n.t(status ? "rows.failed" : "rows.offline", { status }));
    if (told === null) return;
    drawTable(told, i18n);
    drawClocks(told, i18n);
    await drawFigure(told, i18n);
  }

  function redraw() {
    times = 0;
    load();
  }

  /** @param {string} wanted its id, or none for all */
  function ask(wanted) {
    robot = wanted;
    for (const chip of all("[data-of]")) {
      setAttribute(chip, "aria-pressed", String(chip.dataset.of === robot));
    }
    redraw();
  }

  for (const chip of all("[data-of]")) {
    chip.addEventListener("click", () => ask(String(chip.dataset.of)));
  }
  i18n.onChange(() => {
    draw();
    redraw();
  });
  onThemeChange(redraw);
  document.addEventListener("visibilitychange", load);
  setInterval(load, EVERY_MS);
  load();
}

/** @param {string} robot */
const queryOf = (robot) => (robot ? `robot=${robot}` : "");

/**
 * One row of measured and two of printed values, for each kind of data.
 *
 * @param {Latency} told @param {I18n} i18n
 */
function drawTable({ rows, paper, direct }, i18n) {
  const lines = rows.flatMap(({ data, hops }) => [
    line(
      i18n.t(`stream.${data}`),
      i18n.t("hops.source.here"),
      HOPS.map((hop) => cellOf(hops[hop], i18n)),
    ),
    ...Object.entries(paper).map(([place, printed]) =>
      line(
        "",
        i18n.t(`hops.source.${place}`),
        HOPS.map((hop) => printedOf(printed[data], PRINTED[hop], i18n)),
      ),
    ),
  ]);
  need("#hops-table tbody").replaceChildren(...lines);
  setText(need("#hops-note"), direct ? "" : i18n.t("hops.no_direct"));
}

/** @param {string} data @param {string} source @param {string[]} cells */
function line(data, source, cells) {
  const row = make("tr");
  const head = make("th", "", data);
  head.setAttribute("scope", "row");
  row.append(head, make("td", "", source));
  row.append(...cells.map((text) => make("td", "number", text)));
  return row;
}

/** @param {Spread} spread @param {I18n} i18n */
function cellOf({ count, mean_ms, p95_ms }, i18n) {
  if (!count) return NOTHING;
  return i18n.t("hops.measured", { mean: mean_ms, p95: p95_ms, count });
}

/**
 * @param {Record<string, number>} row @param {string | undefined} hop @param {I18n} i18n
 */
function printedOf(row, hop, i18n) {
  if (!hop) return NOTHING;
  const [mean, p95] = [row[`${hop}_mean`], row[`${hop}_p95`]];
  return i18n.t("hops.printed", { mean, p95 });
}

/** @param {Latency} told @param {I18n} i18n */
function drawClocks({ clocks }, i18n) {
  const said = clocks.map(({ robot_id, state, offset_ms, uncertainty_ms }) =>
    i18n.t(`hops.clock.${state}`, {
      robot: robot_id,
      offset: offset_ms,
      within: uncertainty_ms,
    }),
  );
  need("#hops-clocks").replaceChildren(...said.map((text) => make("li", "", text)));
}

/** @param {Latency} told @param {I18n} i18n */
async function drawFigure(told, i18n) {
  const figure = told.figures.cdf;
  if (!figure) return;
  const place = need("#hops-cdf");
  const isEmpty = figure.data.length === 0;
  setHidden(place, isEmpty);
  setText(need("#hops-cdf-says"), i18n.t(isEmpty ? "hops.nothing" : "hops.note.cdf"));
  if (isEmpty) return;
  try {
    await drawHopFigure(place, figure, i18n);
  } catch {
    setHidden(need("#hops-error"), false);
    setText(need("#hops-error"), i18n.t("history.error.library"));
  }
}
