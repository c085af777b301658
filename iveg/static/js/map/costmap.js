/**
 * Polls the shared costmap, while the map shows it, and the coverage by cameras into the
 * store, every two seconds.
 *
 * They are large or slow to change, and no robot stops for them, so they are not sent on
 * the live line.
 *
 * @typedef {import("../core/store.js").Store} Store
 */

const EVERY_MS = 2000;

/**
 * @param {Store} store
 * @param {() => boolean} isWanted whether the layer is on
 * @param {() => string | null} [believer] the robot whose own map is shown; null for the
 *   shared one
 * @returns {() => void} ends it
 */
export function followCostmap(store, isWanted, believer = () => null) {
  return follow(store, "costmap", isWanted, () => {
    const robot = believer();
    const query = robot === null ? "" : `?robot=${encodeURIComponent(robot)}`;
    return { path: `costmap${query}`, isStill: () => robot === believer() };
  });
}

/** @param {Store} store @returns {() => void} ends it */
export function followCoverage(store) {
  return follow(
    store,
    "coverage",
    () => true,
    () => ({ path: "coverage", isStill: () => true }),
  );
}

/**
 * @param {Store} store
 * @param {string} topic
 * @param {() => boolean} isWanted
 * @param {() => {path: string, isStill: () => boolean}} ask below `/api/v1/`, and whether
 *   it is still wanted when the answer comes
 */
function follow(store, topic, isWanted, ask) {
  const timer = setInterval(bring, EVERY_MS);

  async function bring() {
    if (document.hidden || store.connection.state !== "open" || !isWanted()) return;
    try {
      const { path, isStill } = ask();
      const headers = { Accept: "application/json" };
      const answer = await fetch(`/api/v1/${path}`, { headers });
      if (isStill() && answer.ok) store.apply(topic, await answer.json());
    } catch {
      // The banner says that the server is unreachable; the next round asks again.
    }
  }

  bring();
  return () => clearInterval(timer);
}
