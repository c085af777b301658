/**
 * Pictures drawn by a worker, on a canvas that the page has transferred to it.
 *
 * At most a few pictures are under way: a worker that is slow draws fewer of them, the
 * newest, and is never behind by more.
 *
 * @typedef {import("./brush.js").Brush} Brush
 * @typedef {import("./brush.js").WhenDrawn} WhenDrawn
 * @typedef {import("./parcel.js").Parcel} Parcel
 * @typedef {import("./layers/labels.js").Vocabulary} Vocabulary
 * @typedef {["add", string, {x: number, y: number}, number] |
 *   ["keepOnly", string[]]} TrailOrder
 * @typedef {{n: number, parcel: Parcel, trails: TrailOrder[],
 *   vocabulary?: Vocabulary | null}} Order
 * @typedef {{canvas: OffscreenCanvas} | {trails: TrailOrder[]} | Order} ToWorker
 * @typedef {{ready: true} | {drawn: number, missingMs: number, began: number}} FromWorker
 *   `began`: since 1970 (ms), because a worker's clock begins with itself
 */

import { scriptUrl } from "../core/scripturl.js";
import { createPacker } from "./parcel.js";

/** Pictures under way at most: one being drawn, one waiting, one to spare. */
const UNDER_WAY = 3;
/** Steps of robots that are kept until the next picture takes them along. */
const STEPS_KEPT = 256;
/** The length of a step of a trail; smaller steps need not be sent. */
const STEP_M = 0.05;

/**
 * @param {HTMLCanvasElement} canvas
 * @param {() => void} onFailure the worker never came up, and the canvas is still here
 * @returns {Brush}
 */
export function createRemoteBrush(canvas, onFailure) {
  const worker = startWorker();
  const packer = createPacker();
  const steps = createSteps((trails) => post({ trails }));
  /** @type {{n: number, whenDrawn: WhenDrawn}[]} */
  let underWay = [];
  /** @type {(() => void) | null} */
  let held = null;
  /** @type {Vocabulary | null} */
  let said = null;
  let isReady = false;
  let n = 0;

  /** @param {ToWorker} order @param {Transferable[]} [given] */
  function post(order, given = []) {
    worker.postMessage(order, given);
  }

  /** @param {FromWorker} told */
  function hear(told) {
    if ("ready" in told) return handOver();
    const mine = underWay.find((one) => one.n === told.drawn);
    underWay = underWay.filter((one) => one.n > told.drawn);
    mine?.whenDrawn(told.missingMs, told.began - performance.timeOrigin);
    const compose = held;
    held = null;
    compose?.();
  }

  function handOver() {
    isReady = true;
    const given = canvas.transferControlToOffscreen();
    post({ canvas: given }, [given]);
  }

  worker.addEventListener("message", (event) => hear(event.data));
  worker.addEventListener("error", (event) => {
    reportError(event.error ?? new Error(event.message || "the map's worker failed"));
    if (!isReady) onFailure();
  });

  return {
    trails: steps,
    soon(compose) {
      if (underWay.length < UNDER_WAY) queueMicrotask(compose);
      else held = compose;
    },
    draw(picture, whenDrawn) {
      n += 1;
      underWay.push({ n, whenDrawn });
      const { vocabulary } = picture.labels;
      const news = vocabulary === said ? {} : { vocabulary };
      said = vocabulary;
      post({ n, parcel: packer.pack(picture), trails: steps.take(), ...news });
    },
    end: () => worker.terminate(),
  };
}

/** Named by the limits, so that modules can read them as they are loaded. */
function startWorker() {
  const url = scriptUrl(new URL("./mapworker.js", import.meta.url).href);
  return new Worker(url, { type: "module", name: document.body.dataset.limits });
}

/**
 * Records the changes of trails for the worker that keeps them.
 *
 * @param {(orders: TrailOrder[]) => void} tell
 */
function createSteps(tell) {
  /** @type {TrailOrder[]} */
  let orders = [];
  /** @type {Map<string, {x: number, y: number}>} */
  const last = new Map();

  function take() {
    const taken = orders;
    orders = [];
    return taken;
  }

  /** @param {TrailOrder} order */
  function note(order) {
    orders.push(order);
    // A hidden page composes no pictures, but its robots go on.
    if (orders.length >= STEPS_KEPT) tell(take());
  }

  return {
    take,
    /** @param {string} robotId @param {{x: number, y: number}} pose @param {number} atMs */
    add(robotId, { x, y }, atMs) {
      const was = last.get(robotId);
      if (was && Math.hypot(was.x - x, was.y - y) < STEP_M) return;
      last.set(robotId, { x, y });
      note(["add", robotId, { x, y }, atMs]);
    },
    /** @param {ReadonlyMap<string, unknown>} robots */
    keepOnly(robots) {
      for (const id of last.keys()) if (!robots.has(id)) last.delete(id);
      note(["keepOnly", [...robots.keys()]]);
    },
  };
}
