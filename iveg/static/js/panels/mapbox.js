/**
 * The map of the live page with its tools.
 *
 * Picking a person opens the decision behind its zone; picking a robot goes to its card;
 * of a place that is known it says since when.
 */

import { installPaintHook } from "../core/painthook.js";
import { takeAsked } from "../core/showing.js";
import { followCostmap, followCoverage } from "../map/costmap.js";
import { hears } from "../map/layers/belief.js";
import { createMap } from "../map/map.js";
import { all, need, setAttribute, setHidden, setText } from "./dom.js";
import { createGoalMap } from "./goal_map.js";
import { drawHidden } from "./hidden_layers.js";
import { createMapFacts } from "./map_facts.js";
import { drawLayers } from "./map_layers.js";
import { onThemeChange } from "./theme.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {ReturnType<typeof createMap>} LiveMap */

/**
 * @param {App} app
 * @param {{open: (decisionId: string, opener: HTMLElement | null) => void}} decision
 */
export function createMapbox(app, decision) {
  const { store, i18n } = app;
  const canvas = /** @type {HTMLCanvasElement} */ (need("#map"));
  const map = createMap(canvas, store, {
    onFollow: showFollowed,
    onMeasure: showMeasure,
    onLegend: () =>
      app.dialogs.open(/** @type {HTMLDialogElement} */ (need("#legend-panel"))),
  });
  app.painting.follow(map);
  installPaintHook(store, map);

  /** @param {string | null} robotId */
  function showFollowed(robotId) {
    const following = need("#following");
    setHidden(following, robotId === null);
    setText(following, robotId ? i18n.t("map.following", { robot: robotId }) : "");
  }

  /** @param {{on: boolean, points: number, metres: number | null}} measure */
  function showMeasure({ on, points, metres }) {
    setAttribute(need("#map-measure"), "aria-pressed", String(on));
    const asks = points === 1 ? "map.measure_second" : "map.measure_first";
    const said = metres === null ? i18n.t(asks) : i18n.t("map.measured", { metres });
    setHidden(need("#measured"), !on);
    setText(need("#measured"), on ? said : "");
  }

  /** A link to a robot: the status line's, on this page or another. */
  function showAsked() {
    const robotId = store.get("snapshot") ? takeAsked() : null;
    if (robotId === null || !store.robots().has(robotId)) return;
    map.follow(robotId);
    need("#map-panel").scrollIntoView({ block: "nearest" });
  }

  function showBeliever() {
    const robot = map.believer();
    const known = robot === null ? undefined : store.robots().get(robot);
    const key = known && !hears(known) ? "map.believing_deaf" : "map.believing";
    setHidden(need("#believing"), !known);
    setText(need("#believing"), known ? i18n.t(key, { robot }) : "");
  }

  /** @param {{kind: string, id: string}} picked */
  function onPick({ kind, id }) {
    if (kind === "robot") return goToCard(id);
    const decisionId = decisionAbout(id);
    if (decisionId) decision.open(decisionId, canvas);
  }

  /**
   * The decision because of a person: the open one, else the last one.
   *
   * @param {string} personId
   */
  function decisionAbout(personId) {
    for (const { speed_limit: limit } of store.robots().values()) {
      if (limit?.cause === personId) return limit.decision_id;
    }
    const told = store.log().filter(({ slots }) => slots.person === personId);
    return told.findLast(({ decision_id }) => decision_id)?.decision_id ?? null;
  }

  const drawFacts = createMapFacts(app, map);
  const showHidden = () => drawHidden(map.layers(), i18n);

  function drawTexts() {
    map.setLanguage(i18n.t);
    drawLayers(app, map, showBeliever);
    showHidden();
    showBeliever();
    drawFacts();
    showFollowed(map.followed());
  }

  need("#map-measure").addEventListener("click", () =>
    map.setMeasuring(!map.isMeasuring()),
  );
  const goals = createGoalMap(app, map);
  // Before the panels hear it: the key that closes a panel ends no measuring.
  const isPanelOpen = () => document.body.hasAttribute("data-panel");
  function onKey(/** @type {KeyboardEvent} */ { key }) {
    if (key !== "Escape" || isPanelOpen()) return;
    map.setMeasuring(false);
    goals.end();
  }
  document.addEventListener("keydown", onKey, { capture: true });
  need("#layers").addEventListener("change", showHidden);
  wireZoom(map);
  addEventListener("hashchange", showAsked);
  document.addEventListener("iveg:follow", (event) => {
    map.follow(/** @type {CustomEvent<string>} */ (event).detail);
  });
  map.onPick(onPick);
  if (!document.body.hasAttribute("data-past")) followPresent(map, store);
  onThemeChange(() => map.setTheme());
  store.subscribe("robots/", showBeliever);
  store.subscribe("snapshot", drawTexts);
  i18n.onChange(drawTexts);
  drawTexts();
  store.subscribe("snapshot", showAsked);
  showAsked();
  for (const tool of all(".map-tools [disabled]")) tool.removeAttribute("disabled");
}

/** What only the present has: costmap and coverage.
 * @param {LiveMap} map @param {App["store"]} store */
function followPresent(map, store) {
  const isOn = (/** @type {string} */ layer) => () =>
    map.layers().some(({ name, on }) => name === layer && on);
  followCostmap(store, isOn("costmap"), map.believer);
  followCoverage(store);
}

/** @param {LiveMap} map */
function wireZoom(map) {
  need("#map-fit").addEventListener("click", () => map.fit());
  need("#map-in").addEventListener("click", () => map.zoomBy(1));
  need("#map-out").addEventListener("click", () => map.zoomBy(-1));
}

/** @param {string} robotId */
function goToCard(robotId) {
  const card = all(".card").find(({ dataset }) => dataset.robot === robotId);
  card?.scrollIntoView({ block: "nearest", inline: "nearest" });
  const menu = /** @type {HTMLElement | null | undefined} */ (
    card?.querySelector('[data-part="menu"]')
  );
  menu?.focus({ preventScroll: true });
}
