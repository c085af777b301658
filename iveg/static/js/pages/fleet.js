/**
 * The Fleet page: the data path as a diagram, and each robot.
 */

import { aboutAge, ageOf, isSilent, linkOfRobot } from "../core/clock.js";
import { capitalised, sentenceOf, situationOf } from "../core/situation.js";
import {
  all,
  fill,
  make,
  need,
  setAttribute,
  setHidden,
  setText,
} from "../panels/dom.js";
import { readingsOf } from "../panels/readings.js";
import { isHeard, taskSaid } from "../panels/robot_texts.js";
import { heardOf, judgeDataPath } from "./health_sentence.js";

/** @typedef {import("../core/protocol.js").Robot} Robot */
/** @typedef {import("../core/i18n.js").I18n} I18n */
/** @typedef {import("../core/store.js").ConnectionState} ConnectionState */

const TICK_MS = 500;

/** @param {import("../core/page.js").Page} page */
export function start(page) {
  const { store, i18n } = page;

  function draw() {
    const robots = [...store.robots().values()];
    drawDataPath(robots);
    setHidden(need("#machines-empty"), robots.length > 0);
    const isKnown = Boolean(store.get("snapshot"));
    setText(need("#machines-empty"), i18n.t(isKnown ? "robot.none" : "rows.loading"));
    fillRows(
      "#machines tbody",
      robots.map((robot) => machineCells(robot, i18n, store.connection.state)),
    );
    hideEmptyColumns(need("#machines"));
  }

  /** @param {Robot[]} robots */
  function drawDataPath(robots) {
    const isOpen = store.connection.state === "open";
    /** @type {import("../core/protocol.js").Health | null} */
    const health = store.get("health") ?? null;
    const heard = heardOf(robots);
    const hops = health?.hops ?? [];
    const isHeard = isOpen || store.connection.state === "connecting";
    const found = judgeDataPath(hops, heard, isHeard);
    setAttribute(need("#data-path-status"), "data-state", found.state);
    setText(need("#data-path-sentence"), i18n.t(found.key, found.slots));
    for (const box of all(".hop-box")) drawBox(box, hops, heard);
  }

  /** @param {HTMLElement} box @param {import("../core/protocol.js").Health["hops"]} hops
   * @param {import("./health_sentence.js").Heard[]} robots */
  function drawBox(box, hops, robots) {
    const name = String(box.dataset.hop);
    const isOpen = store.connection.state === "open";
    if (name === "robots") {
      const live = robots.filter(({ link }) => link === "LIVE").length;
      const isDown = robots.some(({ link }) => isSilent(link));
      const state = isDown ? "down" : live < robots.length ? "late" : "ok";
      setAttribute(box, "data-state", robots.length ? state : "unknown");
      const slots = { live, total: robots.length };
      setText(need("small", box), i18n.t("fleet.robots_live", slots));
    } else if (name === "server" || name === "screen") {
      const state = isOpen || name === "screen" ? "ok" : "down";
      drawState(box, state);
    } else {
      const hop = hops.find((it) => it.hop === name);
      setHidden(box, !hop && Boolean(box.closest(".hop-row--beside")));
      // The server's last ages are out of date once it is silent.
      drawState(box, hop && isOpen ? hop.state : "unknown");
    }
  }

  /** @param {HTMLElement} box @param {string} state */
  function drawState(box, state) {
    setAttribute(box, "data-state", state);
    setText(need("small", box), i18n.t(`health.state.${state}`));
  }

  store.subscribe("health", draw);
  store.subscribe("connection", draw);
  i18n.onChange(draw);
  setInterval(draw, TICK_MS);
  store.subscribe("snapshot", draw);
  draw();
}

/** Hides columns in which no robot has a value. @param {HTMLElement} table */
function hideEmptyColumns(table) {
  const rows = [...table.querySelectorAll("tbody tr")];
  table.querySelectorAll("th").forEach((head, j) => {
    const isEmpty =
      rows.length > 0 && rows.every(({ children }) => children[j]?.textContent === "—");
    for (const cell of [head, ...rows.map(({ children }) => children[j])]) {
      setHidden(/** @type {HTMLElement} */ (cell), isEmpty);
    }
  });
}

/** @param {number} age (s) @param {I18n} i18n */
function ageSaid(age, i18n) {
  return Number.isFinite(age) ? i18n.t("health.age", { age }) : i18n.t("fleet.never");
}

/** How it stands with a robot.
 * @param {Robot} robot @param {I18n} i18n @param {ConnectionState} connection */
export const statusOf = (robot, i18n, connection) =>
  capitalised(sentenceOf(situationOf(robot, performance.now(), connection), i18n));

/**
 * @param {Robot} robot @param {I18n} i18n @param {ConnectionState} connection
 * @returns {(string | Node)[]}
 */
function machineCells(robot, i18n, connection) {
  const link = linkOfRobot(robot);
  const age = aboutAge(robot, ageSaid(ageOf(robot), i18n), i18n);
  const { profile, navigation, clock_offset_s, holds } = robot;
  const isKnown = isHeard(robot);
  const sources = holds.map(({ source }) => i18n.t(`release.hold_source.${source}`));
  return [
    make("b", "", robot.robot_id),
    `${i18n.t(`robot.link.${link}`)} · ${age}`,
    statusOf(robot, i18n, connection),
    profile && isKnown ? i18n.t("robot.profile", profile) : "—",
    navigation?.task ? taskSaid(navigation.task, i18n) : "—",
    robot.transport && isKnown ? i18n.t(`fleet.transport.${robot.transport}`) : "—",
    clock_offset_s === null ? "—" : i18n.t("fleet.clock", { offset: clock_offset_s }),
    robot.cmd_status ?? "—",
    sources.length ? [...new Set(sources)].join(", ") : "—",
    readingsSaid(robot, i18n),
  ];
}

/** @param {Robot} robot @param {I18n} i18n */
function readingsSaid(robot, i18n) {
  const readings = readingsOf(robot, i18n);
  const said = readings.map(({ label, said }) => `${label}: ${said}`);
  return said.join(" · ");
}

/**
 * Writes a table's cells in place, so that a reader keeps the place.
 *
 * @param {string} selector
 * @param {(string | Node)[][]} rows
 */
function fillRows(selector, rows) {
  fill(
    need(selector),
    rows,
    () => make("tr"),
    (row, cells) => fill(row, cells, () => make("td"), writeCell),
  );
}

/** @param {Element} place @param {string | Node} cell */
function writeCell(place, cell) {
  const said = typeof cell === "string" ? cell : (cell.textContent ?? "");
  if (place.textContent !== said) place.replaceChildren(cell);
}
