/**
 * Tells a measuring script which messages are visible since the frame just drawn.
 *
 * `window.__onPaint({robot, kind, stamp})`, if a script defined it; `stamp` exactly as
 * the robot sent it.  A message that a newer one replaced before a frame came was never
 * drawn and is not reported.
 *
 * @typedef {{robot: string, kind: "odom" | "lidar" | "detection", stamp: string}} Painted
 */

/** @typedef {import("../map/frames.js").WhenDrawn} WhenDrawn */

/**
 * Listens for a script that defines `window.__onPaint`, now or later.  Until there is
 * one, neither store nor map are watched for it.
 *
 * @param {Pick<import("./store.js").Store, "watch">} store
 * @param {{onDrawn: (fn: WhenDrawn) => () => void}} map
 * @returns {() => void} ends it
 */
export function installPaintHook(store, map) {
  const page = /** @type {any} */ (globalThis);
  let listener = page.__onPaint;
  /** @type {(() => void)[]} */
  let endings = [];
  /** @param {((painted: Painted) => void) | undefined} next */
  function hear(next) {
    listener = next;
    for (const end of endings) end();
    endings = listener ? attach(store, map, (painted) => listener(painted)) : [];
  }
  const get = () => listener;
  Object.defineProperty(page, "__onPaint", { configurable: true, get, set: hear });
  hear(listener);
  return () => {
    hear(undefined);
    delete page.__onPaint;
  };
}

/**
 * @param {Pick<import("./store.js").Store, "watch">} store
 * @param {{onDrawn: (fn: WhenDrawn) => () => void}} map
 * @param {(painted: Painted) => void} tell
 */
function attach(store, map, tell) {
  const hook = createPaintHook(tell);
  return [
    store.watch((data, topic) => hook.arrived(topic, data)),
    map.onDrawn(hook.drawn),
  ];
}

/** @param {(painted: Painted) => void} tell */
function createPaintHook(tell) {
  /** @type {Map<string, Painted>} and not drawn yet */
  const arrived = new Map();
  /** @type {Map<string, string>} */
  const told = new Map();

  return {
    /** @param {string} topic @param {any} data */
    arrived(topic, data) {
      const kind = kindOf(topic);
      if (!kind || !data?.stamp) return;
      const name = `${kind}/${data.robot_id}`;
      // The same pose comes again when only a speed limit changed; it is drawn already.
      if (told.get(name) === data.stamp) return;
      arrived.set(name, { robot: data.robot_id, kind, stamp: data.stamp });
    },
    /** @type {WhenDrawn} */
    drawn(hasScans) {
      for (const [name, painted] of arrived) {
        // Detections are drawn with the scans.
        if (painted.kind !== "odom" && !hasScans) continue;
        arrived.delete(name);
        told.set(name, painted.stamp);
        tell(painted);
      }
    },
  };
}

/** @param {string} topic @returns {Painted["kind"] | null} */
function kindOf(topic) {
  const [head, , leaf] = topic.split("/");
  if (head === "detections") return "detection";
  if (head !== "robots") return null;
  return leaf === "scan" ? "lidar" : "odom";
}
