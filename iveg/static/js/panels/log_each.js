/**
 * Each detection, on demand: the log tells a sighting once, at its start, and this list
 * every box of every frame, with its source, class and confidence.
 *
 * @typedef {import("../core/protocol.js").Entry} Entry
 * @typedef {{at: string, robot_id: string, class: string | null, class_id: string,
 *   probability: number, person_id: string | null}} Detection a row of the API
 */

import { readApi } from "../core/api.js";
import { need, setAttribute } from "./dom.js";

const PERIOD_MS = 1000;
/** Rows that are read at once: half a second of two robots with three people each. */
const ROWS = 100;

/**
 * @param {{read?: typeof readApi, isStill: () => boolean, onChange: () => void}} options
 *   `isStill`: somebody reads, and the list must not move
 */
export function createLogEach({ read = readApi, isStill, onChange }) {
  const button = need("#log-each");
  /** @type {Entry[]} oldest first, as the log has them */
  let entries = [];
  let isOn = false;
  let empty = "logpanel.each_none";
  /** Counts the presses: an answer to one that is over is shown no more. */
  let turn = 0;

  /** @param {number} mine */
  async function poll(mine) {
    if (!isOn || mine !== turn) return;
    if (!isStill() && document.visibilityState === "visible") {
      const { status, body } = await read(`detections/latest?limit=${ROWS}`);
      if (!isOn || mine !== turn) return;
      const isRead = status === 200 && Array.isArray(body?.items);
      entries = isRead ? body.items.map(entryOf).reverse() : [];
      empty = isRead ? "logpanel.each_none" : "logpanel.each_failed";
      onChange();
    }
    setTimeout(poll, PERIOD_MS, mine);
  }

  /** @param {boolean} on */
  function show(on) {
    if (isOn === on) return;
    isOn = on;
    turn += 1;
    entries = [];
    setAttribute(button, "aria-pressed", String(on));
    onChange();
    poll(turn);
  }

  button.addEventListener("click", () => show(!isOn));
  return {
    isOn: () => isOn,
    /** What is shown: each detection, or the log where nobody has asked for them.
     * @param {readonly Entry[]} log */
    entries: (log) => (isOn ? entries : log),
    /** Key of what is said of an empty list. */
    empty: () => empty,
    off: () => show(false),
  };
}

/**
 * A detection as an entry of the log.
 *
 * @param {Detection} detection
 * @param {number} index
 * @returns {Entry}
 */
export function entryOf(detection, index) {
  const { at, robot_id, class_id, probability, person_id } = detection;
  const key = person_id ? "log.detection_each_of" : "log.detection_each";
  const slots = {
    ...{ robot: robot_id, class: detection.class ?? class_id, class_id },
    ...{ confidence: probability, person: person_id },
  };
  const told = { kind: "detection", robot_id, key, slots, class: detection.class };
  // The log counts up from 1; rows that it does not have must never be taken for its own.
  return { ...told, id: -1 - index, at, decision_id: null };
}
