/**
 * The legend: every sign of the map, drawn by the layer that draws it on the map.
 */

import { LIMITS } from "../core/limits.js";
import { UNHEARD } from "../core/situation.js";
import { createCostmapLayer } from "../map/layers/costmap.js";
import * as coverage from "../map/layers/coverage.js";
import * as detections from "../map/layers/detections.js";
import * as encounters from "../map/layers/encounters.js";
import * as equipment from "../map/layers/equipment.js";
import * as greenhouse from "../map/layers/greenhouse.js";
import * as grid from "../map/layers/grid.js";
import * as intent from "../map/layers/intent.js";
import * as known from "../map/layers/known.js";
import { createLabels } from "../map/layers/labels.js";
import * as links from "../map/layers/links.js";
import * as people from "../map/layers/people.js";
import * as robots from "../map/layers/robot.js";
import * as scalebar from "../map/layers/scalebar.js";
import { createScanLayer } from "../map/layers/scan.js";
import { readTheme } from "../map/layers/theme.js";
import * as trail from "../map/layers/trail.js";
import { NOTHING } from "../map/scene.js";
import { make, need } from "./dom.js";

/**
 * @typedef {import("../map/layers/paint.js").Paint} Paint
 * @typedef {import("../map/scene.js").Scene} Scene
 * @typedef {{name: string, layer: string, draw: (paint: Paint) => void,
 *   scene?: object, scale?: number, right?: number, up?: number}} Sign `right`, `up`: the picture's
 *   middle (m)
 */

const WIDTH = 88;
const HEIGHT = 56;
const SCALE = 20;

const ROBOT = {
  id: "",
  slot: 1,
  pose: { x: 0, y: 0, yaw: 0 },
  link: "LIVE",
  ageS: 0,
  situation: UNHEARD,
  replay: false,
  drive: "differential",
  length: 1.2,
  width: 0.7,
  task: null,
  goal: null,
  path: [],
  unsureM: 0,
  encounters: [],
};
const PERSON = {
  id: "",
  peer: false,
  stage: "seen",
  x: 0,
  y: 0,
  ageS: 0,
  ringM: 1.2,
  confidence: 1,
  observers: [],
  acting: [],
  decisionId: null,
};
const BOX = {
  id: "",
  robotId: "",
  slot: 1,
  x: 0,
  y: 0,
  yaw: 0,
  length: 0.8,
  width: 0.6,
  probability: 0.9,
  confident: true,
  named: true,
  item: {},
};
const TILE = {
  place: { x: 0, y: 0.4 },
  state: "ok",
  value: 2.4,
  unit: "mS/cm",
  decimals: 1,
};
const GREENHOUSE = {
  bounds: { xmin: -9, xmax: 9, ymin: -9, ymax: 9 },
  lanes: [],
  rows: [],
  posts: [],
  obstacles: [],
};
const HALF_SPEED = { ...UNHEARD, state: "half", slots: { factor: LIMITS.slow_factor } };
const IN_DANGER = { ...UNHEARD, level: "danger" };
const LOCKED = { ...UNHEARD, level: "locked" };
const LEFT = { ...ROBOT, pose: { x: -1.3, y: 0, yaw: 0 } };
const RIGHT = { ...PERSON, x: 1.3, ringM: 0 };
const LANE = { label: "", xmin: -2, xmax: 2, ymin: -0.8, ymax: 0.8 };

/** @param {object} [differs] */
const oneRobot = (differs) => ({ robots: [{ ...ROBOT, ...differs }] });
/** @param {object} [differs] */
const onePerson = (differs) => ({ people: [{ ...PERSON, ...differs }] });
/** @param {object} differs */
const greenhouseWith = (differs) => ({ map: { ...GREENHOUSE, ...differs } });
/** @param {(number | null)[]} ages */
const looked = (ages) => ({
  coverage: {
    receivedAtMs: 0,
    lanes: [{ ...LANE, columns: 4, rows: 1, ages_s: ages }],
  },
});
const crumbs = trail.createTrails();
for (let n = 0; n < 12; n += 1) crumbs.add("", { x: n / 4 - 1.5, y: 0 }, n);

/** @type {Sign[]} one or more of each layer of the map */
export const SIGNS = [
  { name: "robot", layer: "robot", draw: robots.draw, scene: oneRobot() },
  {
    name: "late",
    layer: "robot",
    draw: robots.draw,
    scene: oneRobot({ link: "LATE", ageS: 1.8 }),
    right: 0.95,
    up: 0.75,
  },
  {
    name: "lost",
    layer: "robot",
    draw: robots.draw,
    scene: oneRobot({ link: "LOST", ageS: 5 }),
    right: 1.5,
    up: 0.75,
  },
  {
    name: "slow",
    layer: "robot",
    draw: robots.draw,
    scene: oneRobot({ situation: HALF_SPEED }),
    right: 0.95,
    up: 0.75,
  },
  {
    name: "held",
    layer: "robot",
    draw: robots.draw,
    scene: oneRobot({ situation: LOCKED }),
    right: -0.5,
    up: 0.75,
  },
  {
    name: "unsure",
    layer: "robot",
    draw: robots.draw,
    scene: oneRobot({ unsureM: 0.6, situation: IN_DANGER }),
  },
  { name: "seen", layer: "people", draw: people.draw, scene: onePerson() },
  {
    name: "remembered",
    layer: "people",
    draw: people.draw,
    scene: onePerson({ stage: "remembered", ageS: 4 }),
  },
  {
    name: "last_seen",
    layer: "people",
    draw: people.draw,
    scene: onePerson({ stage: "last_seen", ageS: 20 }),
  },
  {
    name: "peer",
    layer: "people",
    draw: people.draw,
    scene: onePerson({ peer: true }),
  },
  {
    name: "detection",
    layer: "detections",
    draw: detections.draw,
    scene: { detections: [BOX] },
  },
  {
    name: "faint",
    layer: "detections",
    draw: detections.draw,
    scene: { detections: [{ ...BOX, confident: false }] },
  },
  {
    name: "sight",
    layer: "links",
    draw: (paint) => {
      links.draw(paint);
      robots.draw(paint);
      people.draw(paint);
    },
    scene: { robots: [LEFT], people: [{ ...RIGHT, observers: [""] }] },
  },
  {
    name: "blind",
    layer: "links",
    draw: (paint) => {
      links.draw(paint);
      robots.draw(paint);
      people.draw(paint);
    },
    scene: {
      robots: [LEFT],
      people: [
        { ...RIGHT, acting: [{ robot_id: "", distance_m: 1.9, in_sight: false }] },
      ],
    },
  },
  {
    name: "equipment",
    layer: "equipment",
    draw: equipment.draw,
    scene: { tiles: [TILE] },
  },
  {
    name: "intent",
    layer: "intent",
    draw: intent.draw,
    scene: oneRobot({
      path: [
        [-1.5, -0.4],
        [0, 0.3],
        [1.4, 0],
      ],
      goal: { x: 1.4, y: 0 },
    }),
  },
  {
    name: "encounter",
    layer: "encounters",
    draw: encounters.draw,
    scene: {
      robots: [
        {
          ...LEFT,
          encounters: [
            {
              cause: "",
              reason: "person",
              in_s: 1.8,
              probability: 0.9,
              place: { x: 0, y: 0 },
              centre: { x: 1.2, y: 0 },
              radius_m: 1.2,
            },
          ],
        },
      ],
    },
  },
  {
    name: "trail",
    layer: "trail",
    draw: (paint) => trail.draw(paint, crumbs, 60),
    scene: oneRobot({ pose: { x: 1.5, y: 0, yaw: 0 } }),
  },
  {
    name: "scan",
    layer: "scan",
    draw: (paint) => createScanLayer()(paint),
    scene: {
      scans: [
        {
          robotId: "",
          slot: 1,
          strength: 1,
          points: Float32Array.from({ length: 40 }, (_, i) =>
            i % 2 ? 0.4 * Math.sin(i / 6) : i / 10 - 2,
          ),
        },
      ],
    },
  },
  {
    name: "costmap",
    layer: "costmap",
    draw: createCostmapLayer(),
    scene: {
      costmap: {
        resolution: 1,
        width: 4,
        height: 1,
        origin: { x: -2, y: -0.5 },
        data: [0, 30, 60, 100],
      },
    },
  },
  {
    name: "coverage",
    layer: "coverage",
    draw: coverage.draw,
    scene: looked([0, 30, 120, null]),
  },
  known.SIGN,
  {
    name: "aisle",
    layer: "greenhouse",
    draw: greenhouse.draw,
    scene: greenhouseWith({ lanes: [LANE] }),
  },
  {
    name: "crop",
    layer: "greenhouse",
    draw: greenhouse.draw,
    scene: greenhouseWith({ rows: [{ ...LANE, ymin: -0.4, ymax: 0.4 }] }),
  },
  {
    name: "post",
    layer: "greenhouse",
    draw: greenhouse.draw,
    scene: greenhouseWith({ posts: [{ x: 0, y: 0, radius: 0.15 }] }),
  },
  {
    name: "things",
    layer: "greenhouse",
    draw: greenhouse.draw,
    scene: greenhouseWith({
      obstacles: [
        { kind: "crates", xmin: -1.5, xmax: -0.4, ymin: -0.4, ymax: 0.4 },
        { kind: "trolley", xmin: 0.5, xmax: 1.5, ymin: -0.6, ymax: 0.6 },
      ],
    }),
  },
  { name: "grid", layer: "grid", draw: grid.draw, scale: 36 },
  { name: "scalebar", layer: "scalebar", draw: scalebar.draw },
];

/** @param {import("../main.js").App} app */
export function createLegend({ i18n }) {
  const panel = /** @type {HTMLDialogElement} */ (need("#legend-panel"));

  function draw() {
    if (!panel.open) return;
    need("#legend").replaceChildren(...SIGNS.map((sign) => rowOf(sign, i18n)));
  }

  document.addEventListener("iveg:panel", draw);
  i18n.onChange(draw);
}

/** @param {Sign} sign @param {import("../core/i18n.js").I18n} i18n */
function rowOf(sign, i18n) {
  const row = make("li");
  const canvas = make("canvas");
  [canvas.width, canvas.height] = [WIDTH * devicePixelRatio, HEIGHT * devicePixelRatio];
  canvas.style.width = `${WIDTH}px`;
  canvas.style.height = `${HEIGHT}px`;
  canvas.setAttribute("aria-hidden", "true");
  paintSign(canvas, sign, createLabels(i18n.t));
  row.append(canvas, make("span", "", i18n.t(`map.sign.${sign.name}`)));
  return row;
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Sign} sign
 * @param {Paint["labels"]} labels
 */
export function paintSign(
  canvas,
  { draw, scene, scale = SCALE, right = 0, up = 0 },
  labels,
) {
  const ctx = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const theme = readTheme(need("#map"));
  ctx.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
  ctx.fillStyle = theme.bg;
  ctx.fillRect(0, 0, WIDTH, HEIGHT);
  const view = { width: WIDTH, height: HEIGHT, scale, x: right, y: up };
  draw(
    /** @type {Paint} */ (
      /** @type {unknown} */ ({
        ctx,
        view,
        theme,
        labels,
        followed: null,
        tape: { points: [] },
        scene: { ...NOTHING, ...scene },
      })
    ),
  );
}
