/**
 * A recorded world as a store, so that every panel draws it as it draws the present.
 *
 * @typedef {import("../types.js").PastWorld} PastWorld
 */

import { Store } from "./store.js";

export class PastStore {
  store = new Store();
  /** @type {PastWorld | null} */
  #shown = null;

  constructor() {
    this.store.setConnection("open");
  }

  /** Whether there is a world to be drawn. */
  get isShown() {
    return this.#shown !== null;
  }

  /** Topics of the recording that this version does not know. */
  get leftOut() {
    return this.#shown?.left_out ?? [];
  }

  /** @param {PastWorld} world */
  take(world) {
    const before = this.#shown;
    this.#shown = world;
    const isOn = before !== null && world.at_s >= before.at_s;
    const isNewLog = before?.log.at(-1)?.id !== world.log.at(-1)?.id;
    // Going back, what is older must take the place of what is newer.
    if (!isOn || isNewLog) this.store.apply("snapshot", structuredClone(world));
    this.freshen();
  }

  /** Ages stay those of the moment that is shown, as long as it stands. */
  freshen() {
    if (this.#shown === null) return;
    const { robots, people, detections, scans, alerts, climate } = structuredClone(
      this.#shown,
    );
    for (const robot of robots) this.store.apply(`robots/${robot.robot_id}`, robot);
    for (const [id, frame] of Object.entries(detections)) {
      this.store.apply(`detections/${id}`, frame);
    }
    for (const { robot_id, stamp, points } of scans) {
      const scan = { robot_id, stamp, points: new Float32Array(points.flat()) };
      this.store.apply(`robots/${robot_id}/scan`, scan);
    }
    this.store.apply("people", people);
    this.store.apply("alerts", alerts);
    this.store.apply("climate", climate);
  }
}
