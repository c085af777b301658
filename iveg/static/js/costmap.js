/**
 * Brings the shared costmap to the store while the map shows it.
 *
 * It is served by HTTP and not on the live line: it is large, and nobody stops for it.
 *
 * @typedef {import("./store.js").Store} Store
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
  const timer = setInterval(bring, EVERY_MS);

  async function bring() {
    if (document.hidden || store.connection.state !== "open" || !isWanted()) return;
    try {
      const robot = believer();
      const query = robot === null ? "" : `?robot=${encodeURIComponent(robot)}`;
      const headers = { Accept: "application/json" };
      const answer = await fetch(`/api/v1/costmap${query}`, { headers });
      if (robot !== believer()) return;
      if (answer.ok) store.apply("costmap", await answer.json());
    } catch {
      // The line's own banner tells that the server is gone; the next round asks again.
    }
  }

  bring();
  return () => clearInterval(timer);
}
