/**
 * Tells a measuring script which messages the frame just drawn has brought to the eye.
 *
 * `window.__onPaint({robot, kind, stamp})`, if somebody defined it; `stamp` exactly as
 * the robot sent it.  Messages that a newer one replaced before a frame came were never
 * drawn and are not told.
 *
 * @typedef {{robot: string, kind: "odom" | "lidar" | "detection", stamp: string}} Painted
 */

export function createPaintHook() {
  /** @type {Map<string, Painted>} */
  const arrived = new Map();
  /** @type {Map<string, string>} */
  const told = new Map();
  return {
    /** @param {string} topic @param {any} data */
    arrived(topic, data) {
      const kind = kindOf(topic);
      if (!kind || !data?.stamp) return;
      const name = `${kind}/${data.robot_id}`;
      // The same pose comes again when only a mandate changed; it was drawn already.
      if (told.get(name) === data.stamp) return;
      arrived.set(name, { robot: data.robot_id, kind, stamp: data.stamp });
    },
    /** @param {boolean} hasScans whether the newest scans are in the picture, too */
    painted(hasScans) {
      const listener = /** @type {any} */ (globalThis).__onPaint;
      for (const [name, painted] of arrived) {
        if (!hasScans && painted.kind === "lidar") continue;
        arrived.delete(name);
        told.set(name, painted.stamp);
        listener?.(painted);
      }
    },
  };
}

/** @param {string} topic @returns {Painted["kind"] | null} */
export function kindOf(topic) {
  const [head, , leaf] = topic.split("/");
  if (head === "detections") return "detection";
  if (head !== "robots") return null;
  return leaf === "scan" ? "lidar" : "odom";
}
