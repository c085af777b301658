/**
 * A picture as it is sent to the worker: values that change with every frame are in every
 * parcel; large values that seldom change are in one parcel each time that they change.
 *
 * A value is unchanged while it is the same object, on either side, so layers that are
 * cached for a greenhouse or a sweep stay cached.
 *
 * @typedef {import("./picture.js").Picture} Picture
 * @typedef {import("./scene.js").Scene} Scene
 * @typedef {Record<string, unknown>} News by name: `map`, `scan/AGI` …
 * @typedef {Omit<Picture, "theme" | "labels" | "scene"> & {scene: any, news: News}} Parcel
 *   without the labels, which are functions: a worker has its own
 */

/** Of the greenhouse: one each. */
const GREENHOUSE = /** @type {const} */ (["map", "costmap", "coverage"]);

/** @returns {{pack: (picture: Picture) => Parcel}} */
export function createPacker() {
  /** @type {Map<string, unknown>} */
  const told = new Map();

  /** @param {News} news @param {string} name @param {unknown} value */
  function tell(news, name, value) {
    if (told.has(name) && told.get(name) === value) return;
    told.set(name, value);
    news[name] = value;
  }

  return {
    pack({ theme, labels: _, scene, ...picture }) {
      /** @type {News} */
      const news = {};
      tell(news, "theme", theme);
      for (const name of GREENHOUSE) tell(news, name, scene[name]);
      const { map: _m, costmap: _c, coverage: _v, ...moving } = scene;
      const robots = scene.robots.map(({ path, ...robot }) => {
        tell(news, `path/${robot.id}`, path);
        return robot;
      });
      const scans = scene.scans.map(({ points, ...scan }) => {
        tell(news, `scan/${scan.robotId}`, points);
        return scan;
      });
      const detections = scene.detections.map(seenOnly);
      return { ...picture, news, scene: { ...moving, robots, scans, detections } };
    },
  };
}

/** Layers need no more of a detection than its class. @param {Scene["detections"][0]} it */
function seenOnly({ item, ...detection }) {
  return { ...detection, item: { class_id: item.class_id } };
}

/** @returns {{open: (parcel: Parcel) => Omit<Picture, "labels">}} */
export function createUnpacker() {
  /** @type {Map<string, any>} */
  const known = new Map();
  return {
    /** Opens parcels in their order: a later one leaves out values of an earlier one. */
    open({ news, scene, ...picture }) {
      for (const [name, value] of Object.entries(news)) known.set(name, value);
      const greenhouse = Object.fromEntries(
        GREENHOUSE.map((name) => [name, known.get(name)]),
      );
      const robots = scene.robots.map((/** @type {any} */ robot) => {
        return { ...robot, path: known.get(`path/${robot.id}`) };
      });
      const scans = scene.scans.map((/** @type {any} */ scan) => {
        return { ...scan, points: known.get(`scan/${scan.robotId}`) };
      });
      const theme = known.get("theme");
      return { ...picture, theme, scene: { ...scene, ...greenhouse, robots, scans } };
    },
  };
}
