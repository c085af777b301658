/**
 * The Latency page: each hop at a glance, one message's path, and the paper's table with
 * live values beside the printed ones.
 *
 * @typedef {import("../types.js").SegmentSpread} Spread
 * @typedef {import("../types.js").LatencyStream} Stream
 * @typedef {import("../types.js").LatencyRow["sampled"][number]} Hop
 * @typedef {import("../types.js").LatencyTable & {
 *   figures: Record<string, import("./hop_figures.js").Figure>,
 * }} Latency
 */

import { readApi } from "../core/api.js";
import { all, make, need, setAttribute, setHidden, setText } from "../panels/dom.js";
import { onThemeChange } from "../panels/theme.js";
import { drawHopFigure } from "./hop_figures.js";
import { drawMultiples } from "./hop_multiples.js";

const EVERY_MS = 2000;
/** Figures cost the server more than numbers: every fifth time. */
const DRAW_EVERY = 5;
const HOPS = /** @type {Hop[]} */ ([
  "uplink",
  "fiware",
  "robot_orion",
  "iveg",
  "screen",
]);
const FIGURES = ["trace", "cdf"];
const NOTHING = "—";
/** The paper's name of each hop; it has none for the hops after Orion. */
const PRINTED = /** @type {Record<string, string>} */ ({
  uplink: "uplink",
  fiware: "fiware",
  robot_orion: "total",
});

/** @param {import("../core/page.js").Page} page */
export function start({ i18n }) {
  let asked = { window: "15min", robot: "" };
  /** @type {Latency | null} */
  let told = null;
  let status = 200;
  let times = 0;

  async function load() {
    if (document.hidden) return;
    const query = queryOf(asked);
    const draws = times % DRAW_EVERY === 0;
    times += 1;
    const answer = await readApi(`latency?${query}&figures=${draws}`);
    if (query !== queryOf(asked)) return;
    status = answer.status;
    if (status === 200) told = answer.body;
    await draw();
  }

  async function draw() {
    const failed = need("#hops-error");
    setHidden(failed, status === 200);
    setText(failed, i18n.t(status ? "rows.failed" : "rows.offline", { status }));
    if (told === null) return;
    drawRemarks(told, i18n);
    drawMultiples(need("#hops-glance"), told.rows, i18n);
    drawTable(told, i18n);
    drawClocks(told, i18n);
    drawStreams(told, i18n);
    await drawFigures(told, i18n);
  }

  function redraw() {
    times = 0;
    load();
  }

  /** @param {Partial<typeof asked>} change */
  function ask(change) {
    asked = { ...asked, ...change };
    for (const chip of all("[data-window]")) {
      setAttribute(chip, "aria-pressed", String(chip.dataset.window === asked.window));
    }
    for (const chip of all("[data-of]")) {
      setAttribute(chip, "aria-pressed", String(chip.dataset.of === asked.robot));
    }
    const csv = /** @type {HTMLAnchorElement} */ (need("#hops-csv"));
    csv.href = `/api/v1/latency?format=csv&${queryOf(asked)}`;
    times = 0;
    load();
  }

  for (const chip of all("[data-window]")) {
    chip.addEventListener("click", () => ask({ window: chip.dataset.window }));
  }
  for (const chip of all("[data-of]")) {
    chip.addEventListener("click", () => ask({ robot: chip.dataset.of }));
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

/** @param {{window: string, robot: string}} asked */
function queryOf({ window, robot }) {
  return robot ? `window=${window}&robot=${robot}` : `window=${window}`;
}

/** @param {Latency} told @param {import("../core/i18n.js").I18n} i18n */
function drawRemarks({ remarks, rows }, i18n) {
  const said = remarks.map(({ key, slots }) => i18n.t(key, slots));
  // Of what was not measured nobody knows whether it is behind.
  const isMeasured = rows.some(({ hops }) =>
    Object.values(hops).some(({ count }) => count),
  );
  if (!said.length) said.push(i18n.t(isMeasured ? "hops.well" : "hops.nothing"));
  fill(need("#hops-remarks"), said);
}

/**
 * One row of measured and two of printed values, for each kind of data.
 *
 * @param {Latency} told @param {import("../core/i18n.js").I18n} i18n
 */
function drawTable(told, i18n) {
  const lines = told.rows.flatMap(({ data, hops, sampled }) => [
    line(
      i18n.t(`stream.${data}`),
      i18n.t("hops.source.here"),
      HOPS.map((hop) => cellOf(hops[hop], sampled.includes(hop), i18n)),
    ),
    ...Object.entries(told.paper).map(([place, rows]) =>
      line(
        "",
        i18n.t(`hops.source.${place}`),
        HOPS.map((hop) => printedOf(rows[data], PRINTED[hop], i18n)),
      ),
    ),
  ]);
  need("#hops-table tbody").replaceChildren(...lines);
  const first = told.streams.reduce((sum, one) => sum + one.orion_first, 0);
  const passed = told.streams.reduce((sum, one) => sum + one.fiware.passed, 0);
  const notes = told.direct ? [] : [i18n.t("hops.no_direct")];
  if (first > 0) notes.push(i18n.t("hops.orion_first", { share: first / passed }));
  setText(need("#hops-note"), notes.join(" "));
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

/**
 * @param {Spread} spread @param {boolean} isSampled
 * @param {import("../core/i18n.js").I18n} i18n
 */
function cellOf({ count, mean_ms, p95_ms }, isSampled, i18n) {
  if (!count) return NOTHING;
  const key = isSampled ? "hops.measured_sampled" : "hops.measured";
  return i18n.t(key, { mean: mean_ms, p95: p95_ms, count });
}

/**
 * @param {Record<string, number>} row @param {string | undefined} hop
 * @param {import("../core/i18n.js").I18n} i18n
 */
function printedOf(row, hop, i18n) {
  if (!hop) return NOTHING;
  const [mean, p95] = [row[`${hop}_mean`], row[`${hop}_p95`]];
  return i18n.t("hops.printed", { mean, p95 });
}

/** @param {Latency} told @param {import("../core/i18n.js").I18n} i18n */
function drawClocks({ clocks, pages_within_ms }, i18n) {
  const said = clocks.map((clock) =>
    i18n.t(`hops.clock.${clock.state}`, {
      robot: clock.robot_id,
      offset: clock.offset_ms,
      within: clock.uncertainty_ms,
    }),
  );
  const page = pages_within_ms === null ? "unknown" : "known";
  said.push(i18n.t(`hops.page_clock.${page}`, { within: pages_within_ms }));
  fill(need("#hops-clocks"), said);
}

/** @param {Latency} told @param {import("../core/i18n.js").I18n} i18n */
function drawStreams({ streams }, i18n) {
  const number = (/** @type {number} */ value, decimals = 0) =>
    i18n.number(value, decimals);
  const rows = streams.map((one) => {
    const row = make("tr");
    const kept =
      one.kept_back === null
        ? NOTHING
        : i18n.t("hops.kept_back", { share: one.kept_back });
    const texts = [
      number(one.heard_hz, 1),
      number(one.agent_hz, 1),
      one.throttled ? i18n.t("hops.throttled") : number(one.orion_hz, 1),
      kept,
      number(one.uplink.missing),
      number(one.fiware.missing),
      number(one.uplink.reordered + one.fiware.reordered),
      number(excludedOf(one)),
    ];
    row.append(make("td", "", one.robot_id));
    row.append(make("td", "", i18n.t(`stream.${one.data}`)));
    row.append(...texts.map((text) => make("td", "number", text)));
    return row;
  });
  need("#hops-streams tbody").replaceChildren(...rows);
  fill(need("#hops-excluded"), reasonsOf(streams, i18n));
}

/** @param {Stream} stream */
function excludedOf({ excluded }) {
  const counts = Object.values(excluded).flatMap((of) => Object.values(of));
  return counts.reduce((sum, count) => sum + count, 0);
}

/** @param {Stream[]} streams @param {import("../core/i18n.js").I18n} i18n */
function reasonsOf(streams, i18n) {
  /** @type {Map<string, number>} */
  const counts = new Map();
  for (const { robot_id, excluded } of streams) {
    for (const reasons of Object.values(excluded)) {
      for (const [why, count] of Object.entries(reasons)) {
        const name = `${why} ${robot_id}`;
        counts.set(name, (counts.get(name) ?? 0) + count);
      }
    }
  }
  return [...counts].map(([name, count]) => {
    const [why, robot] = name.split(" ");
    return i18n.t(`hops.excluded.${why}`, { robot, count });
  });
}

/** @param {Latency} told @param {import("../core/i18n.js").I18n} i18n */
async function drawFigures(told, i18n) {
  for (const name of FIGURES) {
    const place = need(`#hops-${name}`);
    const figure = told.figures[name];
    if (!figure) continue;
    setHidden(place, figure.data.length === 0);
    setText(need(`#hops-${name}-says`), noteOf(name, told, i18n));
    if (figure.data.length === 0) continue;
    try {
      await drawHopFigure(place, figure, told, i18n);
    } catch {
      setHidden(need("#hops-error"), false);
      setText(need("#hops-error"), i18n.t("history.error.library"));
    }
  }
}

/**
 * The text alternative of a figure.
 *
 * @param {string} name @param {Latency} told @param {import("../core/i18n.js").I18n} i18n
 */
function noteOf(name, told, i18n) {
  if (told.figures[name].data.length === 0) return i18n.t("hops.nothing");
  if (name !== "trace" || told.trace === null) return i18n.t(`hops.note.${name}`);
  const { robot_id, data, stamp, steps } = told.trace;
  const total = Math.max(...steps.map(({ to_ms }) => to_ms));
  return i18n.t("hops.note.trace", { robot: robot_id, data, stamp, total });
}

/** @param {HTMLElement} list @param {string[]} sentences */
function fill(list, sentences) {
  const said = [...list.children].map(({ textContent }) => textContent);
  // A list that is read out aloud is left alone while it is unchanged.
  if (said.join("\n") === sentences.join("\n")) return;
  list.replaceChildren(...sentences.map((sentence) => make("li", "", sentence)));
}
