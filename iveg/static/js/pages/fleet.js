/**
 * The Fleet page: the chain as a diagram, each robot, and each of its devices.
 */

import { aboutAge, ageOf, linkOfRobot } from "../clock.js";
import { all, make, need, setAttribute, setHidden, setText } from "../panels/dom.js";
import { modeSaid } from "../panels/robot_words.js";
import { judgeChain } from "./chain.js";
import { createTiles } from "./tiles.js";

/** @typedef {import("../protocol.js").Robot} Robot */
/** @typedef {import("../i18n.js").Words} Words */

const TICK_MS = 500;

/** @param {import("../page.js").Page} page */
export function start(page) {
  const { store, words } = page;
  const suffixes = (need("#devices").dataset.suffixes ?? "").split(" ");

  function draw() {
    const robots = [...store.robots().values()];
    drawChain(robots);
    setHidden(need("#machines-empty"), robots.length > 0);
    fill(
      "#machines tbody",
      robots.map((robot) => machineCells(robot, words)),
    );
    const devices = robots.flatMap((robot) =>
      suffixes.map((suffix) => deviceCells(robot, suffix)),
    );
    fill("#devices tbody", devices);
  }

  /** @param {Robot[]} robots */
  function drawChain(robots) {
    const isOpen = store.connection.state === "open";
    /** @type {import("../protocol.js").Health | null} */
    const health = store.get("health") ?? null;
    const silent = robots.filter((robot) => linkOfRobot(robot) === "LOST");
    const hops = health?.hops ?? [];
    const found = judgeChain(
      hops,
      silent.map(({ robot_id }) => robot_id),
      isOpen || store.connection.state === "connecting",
    );
    const said = health || !isOpen ? words.t(found.key, found.slots) : "";
    setAttribute(need("#chain-says"), "data-state", health ? found.state : "unknown");
    if (said) setText(need("#chain-sentence"), said);
    for (const box of all(".hop-box")) drawBox(box, hops, robots, silent.length);
  }

  /** @param {HTMLElement} box @param {import("../protocol.js").Health["hops"]} hops
   * @param {Robot[]} robots @param {number} silent */
  function drawBox(box, hops, robots, silent) {
    const name = String(box.dataset.hop);
    const isOpen = store.connection.state === "open";
    if (name === "robots") {
      const live = robots.filter((robot) => linkOfRobot(robot) === "LIVE").length;
      const state = silent ? "down" : live < robots.length ? "late" : "ok";
      setAttribute(box, "data-state", robots.length ? state : "unknown");
      const slots = { live, total: robots.length };
      setText(need("small", box), words.t("fleet.robots_live", slots));
    } else if (name === "server" || name === "screen") {
      const state = isOpen || name === "screen" ? "ok" : "down";
      drawState(box, state);
    } else {
      const hop = hops.find((it) => it.hop === name);
      setHidden(box, !hop && Boolean(box.closest(".hop-row--beside")));
      // What the server said last is no news once it is silent.
      drawState(box, hop && isOpen ? hop.state : "unknown");
    }
  }

  /** @param {HTMLElement} box @param {string} state */
  function drawState(box, state) {
    setAttribute(box, "data-state", state);
    setText(need("small", box), words.t(`health.state.${state}`));
  }

  /** @param {Robot} robot @param {string} suffix */
  function deviceCells(robot, suffix) {
    const kind = suffix.slice(1) || "robot";
    const id = robot.robot_id;
    const age = ageOfDevice(kind, robot);
    return [
      make("code", "", `${id}${suffix}`),
      words.has(`fleet.measures.${kind}`) ? words.t(`fleet.measures.${kind}`) : kind,
      age === null ? "—" : ageSaid(age, words),
    ];
  }

  /** Age (s) of what a device last brought; null where nobody keeps it.
   * @param {string} kind @param {Robot} robot */
  function ageOfDevice(kind, robot) {
    if (kind === "odom") return ageOf(robot);
    if (kind === "lidar2D") return ageOfKnown(store.scans().get(robot.robot_id));
    if (kind === "yolox_bounding_boxes")
      return ageOfKnown(store.looks().get(robot.robot_id));
    if (kind !== "safety") return null;
    const { applied, receivedAtMs } = robot;
    return applied
      ? ageOf({ age_s: applied.age_s, receivedAtMs })
      : Number.POSITIVE_INFINITY;
  }

  store.subscribe("health", draw);
  store.subscribe("connection", draw);
  words.onChange(draw);
  setInterval(draw, TICK_MS);
  draw();
  createTiles(page);
}

/** @param {import("../clock.js").Aged | undefined} value */
function ageOfKnown(value) {
  return value ? ageOf(value) : Number.POSITIVE_INFINITY;
}

/** @param {number} age (s) @param {Words} words */
function ageSaid(age, words) {
  return Number.isFinite(age) ? words.t("health.age", { age }) : words.t("fleet.never");
}

/** @param {Robot} robot @param {Words} words @returns {(string | Node)[]} */
function machineCells(robot, words) {
  const link = linkOfRobot(robot);
  const age = aboutAge(robot, ageSaid(ageOf(robot), words), words);
  const { profile, navigation, clock_offset_s, holds } = robot;
  const sources = holds.map(({ source }) => words.t(`release.hold_source.${source}`));
  return [
    make("b", "", robot.robot_id),
    `${words.t(`robot.link.${link}`)} · ${age}`,
    link === "LOST" ? "—" : modeSaid(robot, words),
    profile ? words.t("robot.profile", profile) : "—",
    navigation?.task ? taskSaid(navigation.task, words) : "—",
    robot.transport ? words.t(`fleet.transport.${robot.transport}`) : "—",
    clock_offset_s === null ? "—" : words.t("fleet.clock", { offset: clock_offset_s }),
    robot.cmd_status ?? "—",
    sources.length ? [...new Set(sources)].join(", ") : "—",
  ];
}

/** A task in the reader's words; one of another fleet as it was sent.
 * @param {string} task @param {Words} words */
export function taskSaid(task, words) {
  return words.has(`task.${task}`) ? words.t(`task.${task}`) : task;
}

/**
 * Writes a table's cells in place: whoever reads it keeps the place.
 *
 * @param {string} selector
 * @param {(string | Node)[][]} rows
 */
function fill(selector, rows) {
  const body = need(selector);
  while (body.children.length > rows.length) body.lastElementChild?.remove();
  while (body.children.length < rows.length) body.append(make("tr"));
  rows.forEach((cells, i) => {
    const row = body.children[i];
    while (row.children.length < cells.length) row.append(make("td"));
    cells.forEach((cell, j) => {
      const said = typeof cell === "string" ? cell : (cell.textContent ?? "");
      if (row.children[j].textContent !== said) row.children[j].replaceChildren(cell);
    });
  });
}
