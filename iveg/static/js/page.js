/**
 * What stands on a page besides STOP: the shell's panels everywhere, the map's on `/`.
 *
 * Each part starts on its own: one that fails is reported and the others go on.
 */

import { createAlertsPanel } from "./panels/alerts.js";
import { createDecisionPanel } from "./panels/decision.js";
import { createHealthPanel } from "./panels/health.js";

/** @typedef {import("./main.js").App} App */

/** @param {App} app */
export async function startPage(app) {
  const decision = createDecisionPanel(app);
  attempt(() => createAlertsPanel(app));
  attempt(() => createHealthPanel(app));
  if (!document.querySelector("#map")) return;
  const parts = await Promise.allSettled([
    import("./panels/mapbox.js").then(({ createMapbox }) =>
      createMapbox(app, decision),
    ),
    import("./panels/robots.js").then(({ createRobotsPanel }) =>
      createRobotsPanel(app),
    ),
    import("./panels/log.js").then(({ createLogPanel }) =>
      createLogPanel(app, decision),
    ),
    import("./panels/timebar.js").then(({ createTimebar }) => createTimebar(app)),
  ]);
  for (const part of parts) if (part.status === "rejected") reportError(part.reason);
}

/** @param {() => void} start */
function attempt(start) {
  try {
    start();
  } catch (error) {
    reportError(error);
  }
}
