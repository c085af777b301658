/**
 * A small picture of one decision, drawn from its record by the layers of the live map:
 * people and robots at its beginning.  Always on the light palette, so that it prints.
 *
 * @typedef {{robot_id: string, x: number, y: number, yaw: number}} Place
 * @typedef {{x: number | null, y: number | null, class?: string | null,
 *   observer: string | null, robot_id: string | null, in_sight: boolean | null,
 *   distance_m: number | null, confidence: number | null,
 *   rule_parameters: Record<string, any> & {ring_m?: number, places?: Place[]}}} Drawn
 * @typedef {import("../core/protocol.js").GreenhouseMap} GreenhouseMap
 */

import { UNHEARD } from "../core/situation.js";
import { slotOf } from "../core/slots.js";
import * as greenhouse from "../map/layers/greenhouse.js";
import * as grid from "../map/layers/grid.js";
import { createLabels } from "../map/layers/labels.js";
import * as links from "../map/layers/links.js";
import * as people from "../map/layers/people.js";
import * as robots from "../map/layers/robot.js";
import * as scalebar from "../map/layers/scalebar.js";
import { readTheme } from "../map/layers/theme.js";
import { NOTHING } from "../map/scene.js";
import { createViewport, fitTo } from "../map/viewport.js";
import { make } from "./dom.js";

const WIDTH = 360;
const HEIGHT = 260;
const ROUND_M = 1.5;
const BODY = { drive: "differential", length: 1, width: 0.6 };

/**
 * The scene at its beginning; null where the place is unknown.
 *
 * @param {Drawn} decision
 * @param {GreenhouseMap | null} map
 */
export function sceneOf({ x, y, rule_parameters, ...told }, map) {
  if (x === null || y === null) return null;
  const { ring_m: zoneM = 2, places = [] } = rule_parameters;
  const acting = { robot_id: String(told.robot_id), distance_m: told.distance_m ?? 0 };
  const person = {
    id: "",
    peer: told.class === "robot",
    unknown: told.class === "obstacle",
    isThing: false,
    stage: /** @type {const} */ ("seen"),
    x,
    y,
    ageS: 0,
    zoneM,
    confidence: told.confidence ?? 1,
    observers: told.observer ? [told.observer] : [],
    acting: [{ ...acting, in_sight: told.in_sight !== false }],
    decisionId: null,
  };
  return {
    ...NOTHING,
    map,
    robots: places.map(({ robot_id, ...pose }) => ({
      ...BODY,
      id: robot_id,
      slot: slotOf(robot_id),
      pose,
      link: /** @type {const} */ ("LIVE"),
      ageS: 0,
      situation: UNHEARD,
      replay: false,
      isBlind: false,
      task: null,
      goal: null,
      path: [],
      unsureM: 0,
      encounters: [],
      obstacle: null,
    })),
    people: [person],
  };
}

/**
 * @param {Drawn} decision
 * @param {GreenhouseMap | null} map
 * @param {import("../core/i18n.js").I18n} i18n
 * @returns {HTMLCanvasElement | null}
 */
export function drawDecision(decision, map, i18n) {
  const scene = sceneOf(decision, map);
  if (!scene) return null;
  const canvas = document.createElement("canvas");
  const ratio = Math.max(2, devicePixelRatio);
  [canvas.width, canvas.height] = [WIDTH * ratio, HEIGHT * ratio];
  canvas.className = "decision__map";
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", i18n.t("decision.picture"));
  const ctx = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  const theme = paperTheme();
  ctx.fillStyle = theme.bg;
  ctx.fillRect(0, 0, WIDTH, HEIGHT);
  const paint = {
    ctx,
    view: fitTo(createViewport(WIDTH, HEIGHT), boxOf(scene), 34),
    theme,
    scene,
    labels: createLabels(i18n.t),
    followed: null,
    tape: { points: [] },
  };
  for (const layer of [grid, greenhouse, links, robots, people, scalebar]) {
    layer.draw(paint);
  }
  return canvas;
}

function paperTheme() {
  const probe = make("i", "on-paper");
  document.body.append(probe);
  const theme = readTheme(probe);
  probe.remove();
  return theme;
}

/** All that the picture is about (m). @param {NonNullable<ReturnType<typeof sceneOf>>} s */
function boxOf({ people: [person], robots: placed }) {
  const xs = [person.x - person.zoneM, person.x + person.zoneM];
  const ys = [person.y - person.zoneM, person.y + person.zoneM];
  for (const { pose } of placed) {
    xs.push(pose.x - ROUND_M, pose.x + ROUND_M);
    ys.push(pose.y - ROUND_M, pose.y + ROUND_M);
  }
  return {
    xmin: Math.min(...xs),
    xmax: Math.max(...xs),
    ymin: Math.min(...ys),
    ymax: Math.max(...ys),
  };
}
