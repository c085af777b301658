/**
 * The worker that draws the map: takes parcels, draws the newest in the next frame of
 * the screen, and reports its number.
 *
 * @typedef {import("./remotebrush.js").ToWorker} ToWorker
 * @typedef {import("./remotebrush.js").TrailOrder} TrailOrder
 * @typedef {import("./picture.js").Picture} Picture
 */

import { languageOf, Messages } from "../core/messages.js";
import { createLabels } from "./layers/labels.js";
import { createTrails } from "./layers/trail.js";
import { createUnpacker } from "./parcel.js";
import { createPicture } from "./picture.js";

const unpacker = createUnpacker();
const trails = createTrails();
/** @type {ReturnType<typeof createPicture> | null} */
let canvas = null;
/** @type {{n: number, picture: Omit<Picture, "labels">} | null} */
let newest = null;
let labels = createLabels(undefined, "es");
let isAsked = false;

/** @param {MessageEvent<ToWorker>} event */
function take({ data }) {
  if ("canvas" in data) canvas = createPicture(data.canvas, trails);
  if ("trails" in data) for (const order of data.trails) follow(order);
  if ("vocabulary" in data && data.vocabulary) speak(data.vocabulary);
  if ("parcel" in data) newest = { n: data.n, picture: unpacker.open(data.parcel) };
  askForFrame();
}

/** @param {TrailOrder} order */
function follow([act, ...facts]) {
  if (act === "keepOnly") {
    const ids = /** @type {string[]} */ (facts[0]);
    return trails.keepOnly(new Map(ids.map((id) => [id, true])));
  }
  trails.add(.../** @type {[string, {x: number, y: number}, number]} */ (facts));
}

/** @param {import("./layers/labels.js").Vocabulary} vocabulary */
function speak({ language, blocks }) {
  labels = createLabels(new Messages(languageOf(language), blocks).say, language);
}

function askForFrame() {
  if (isAsked || !canvas || !newest) return;
  isAsked = true;
  requestAnimationFrame(draw);
}

/** @param {number} beganMs */
function draw(beganMs) {
  isAsked = false;
  if (!canvas || !newest) return;
  const missingMs = canvas.draw({ ...newest.picture, labels });
  postMessage({ drawn: newest.n, missingMs, began: performance.timeOrigin + beganMs });
}

addEventListener("message", take);
postMessage({ ready: true });
