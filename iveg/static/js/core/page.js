/**
 * The panels of a page besides STOP: those of the shell everywhere, then the route's own.
 *
 * Each panel starts on its own: a failure is reported and the others go on.
 */

import { createAlertsPanel } from "../panels/alerts.js";
import { createDecisionPanel } from "../panels/decision.js";
import { need, setHidden } from "../panels/dom.js";
import { createHealthPanel } from "../panels/health.js";
import { createHints } from "../panels/hints.js";
import { createSignOut } from "../panels/signout.js";
import { labelTables } from "../panels/tables.js";
import { createTone } from "../panels/tone.js";
import { readApi } from "./api.js";
import { guarded } from "./hub.js";
import { createInstalling, registerWorker } from "./install.js";
import { askedMoment, BEFORE_S, isUnread, pastAddress } from "./moments.js";
import { createWakeLock } from "./wakelock.js";

/**
 * @typedef {import("../main.js").App} App
 * @typedef {App & {
 *   tone: import("../panels/tone.js").Tone,
 *   wake: import("./wakelock.js").WakeLock,
 *   installing: ReturnType<typeof createInstalling>,
 * }} Page the parts that the page of a route is given
 */

/** @type {Record<string, () => Promise<{start: (page: Page) => unknown}>>} */
const ROUTES = {
  account: () => import("../pages/account.js"),
  alerts: () => import("../pages/alerts.js"),
  commands: () => import("../pages/commands.js"),
  command: () => import("../pages/command.js"),
  fleet: () => import("../pages/fleet.js"),
  climate: () => import("../pages/climate.js"),
  latency: () => import("../pages/hops.js"),
  sessions: () => import("../pages/sessions.js"),
  settings: () => import("../pages/settings.js"),
  decisions: () => import("../pages/decisions.js"),
  decision: () => import("../pages/decision.js"),
  day: () => import("../pages/day.js"),
  about: () => import("../pages/about.js"),
  audit: () => import("../pages/audit.js"),
  tokens: () => import("../pages/tokens.js"),
  users: () => import("../pages/users.js"),
};

/** @param {App} app */
export async function startPage(app) {
  const decision = createDecisionPanel(app);
  const installing = createInstalling();
  const page = { ...app, installing, tone: createTone(), wake: createWakeLock() };
  guarded(() => createAlertsPanel(app, page.tone));
  guarded(() => createHealthPanel(app));
  guarded(() => createSignOut(app));
  guarded(wirePrinting);
  registerWorker();
  guarded(() => labelTables(app));
  const route = ROUTES[document.body.dataset.route ?? ""];
  if (route) (await route()).start(page);
  if (!document.querySelector("#map")) return;
  guarded(() => page.wake.supervise());
  guarded(() => createHints(app));
  const shown = await shownBy(app);
  const parts = await Promise.allSettled([
    import("../panels/mapbox.js").then(({ createMapbox }) =>
      createMapbox(shown, decision),
    ),
    import("../panels/robots.js").then(({ createRobotsPanel }) =>
      createRobotsPanel(shown),
    ),
    import("../panels/log.js").then(({ createLogPanel }) =>
      createLogPanel(shown, decision),
    ),
    import("../panels/timebar.js").then(({ createTimebar }) => createTimebar(shown)),
    import("../panels/people.js").then(({ createPeoplePanel }) =>
      createPeoplePanel(shown),
    ),
  ]);
  for (const part of parts) if (part.status === "rejected") reportError(part.reason);
  guarded(() => goToAsked(app));
}

/** What the live page shows: now, or the recorded moment that the address names.
 * @param {App} app */
async function shownBy(app) {
  const asked = askedMoment(location.search);
  need("#to-past").addEventListener("click", () =>
    location.assign(pastAddress(app.line.serverNow() - BEFORE_S)),
  );
  if (asked === null) {
    setHidden(need("#past-unread"), !isUnread(location.search));
    readApi("recordings").then(({ body }) =>
      setHidden(need("#to-past"), !body?.items?.length),
    );
    return app;
  }
  const { createTimeTravel } = await import("../panels/time_travel.js");
  return createTimeTravel(app, asked);
}

/**
 * Goes to the part that the address names once it has its height: when the browser went
 * there it was empty.  Whoever has touched the page by then stays where they are.
 *
 * @param {App} app
 */
function goToAsked({ store }) {
  const asked = location.hash && document.getElementById(location.hash.slice(1));
  if (!asked) return;
  const touched = new AbortController();
  const { signal } = touched;
  for (const name of ["pointerdown", "wheel", "keydown"]) {
    addEventListener(name, () => touched.abort(), { signal });
  }
  const go = () => {
    if (!signal.aborted) asked.scrollIntoView();
    touched.abort();
  };
  if (store.get("snapshot")) requestAnimationFrame(go);
  else store.subscribe("snapshot", () => requestAnimationFrame(go));
}

function wirePrinting() {
  for (const button of document.querySelectorAll("[data-prints]")) {
    button.addEventListener("click", () => print());
  }
}
