/**
 * The surroundings of the map: its tools, its layers, and the counts over it.
 *
 * Picking a person opens the decision behind its ring; picking a robot goes to its card.
 */

import { onBeat } from "../core/beat.js";
import { ageOf } from "../core/clock.js";
import { installPaintHook } from "../core/painthook.js";
import { createBrush } from "../map/brush.js";
import { followCostmap, followCoverage } from "../map/costmap.js";
import { hears } from "../map/layers/belief.js";
import { SAID_ON_MAPS } from "../map/layers/labels.js";
import { TRAIL_SPANS_S } from "../map/layers/trail.js";
import { createMap } from "../map/map.js";
import { all, make, need, setAttribute, setHidden, setText } from "./dom.js";
import { drawHidden } from "./hidden_layers.js";
import { createLegend } from "./legend.js";
import { onThemeChange } from "./theme.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/protocol.js").Person} Person */
/** @typedef {ReturnType<typeof createMap>} LiveMap */

const AGE_MS = 1000;
/** The coverage is polled every two seconds. */
const COVERAGE_OLD_S = 6;

/**
 * @param {App} app
 * @param {{open: (decisionId: string, opener: HTMLElement | null) => void}} decision
 */
export function createMapbox(app, decision) {
  const { store, i18n } = app;
  const canvas = /** @type {HTMLCanvasElement} */ (need("#map"));
  const map = createMap(canvas, store, {
    brush: createBrush(canvas),
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

  function drawFacts() {
    const people = store.people().filter(isPresent);
    setText(need("#people-count"), peopleSaid(people.length));
    const unseen = people.flatMap(({ acting }) => acting).filter((it) => !it.in_sight);
    const nlos = need("#nlos-count");
    setHidden(nlos, unseen.length === 0);
    const slowed = new Set(unseen.map(({ robot_id }) => robot_id)).size;
    const key = slowed === 1 ? "map.nlos_one" : "map.nlos_count";
    setText(nlos, i18n.t(key, { count: slowed }));
  }

  /** @param {number} count */
  function peopleSaid(count) {
    const said = coverageSaid(store.get("coverage"), i18n);
    if (count === 0 && said.isBlind) return said.text;
    const seen = count === 1 ? "map.people_one" : "map.people_count";
    const people = count ? i18n.t(seen, { count }) : i18n.t("map.people_none");
    return said.text ? `${people} · ${said.text}` : people;
  }

  function drawCostmapAge() {
    /** @type {import("../core/protocol.js").Costmap | undefined} */
    const costmap = store.get("costmap");
    const isOn = map.layers().some(({ name, on }) => name === "costmap" && on);
    const isKnown = typeof costmap?.age_s === "number";
    const key = isKnown ? "map.costmap_age" : "map.costmap_none";
    setHidden(need("#costmap-age"), !isOn);
    setText(
      need("#costmap-age"),
      i18n.t(key, { age: costmap && isKnown ? ageOf(costmap) : 0 }),
    );
  }

  function drawClimate() {
    /** @type {import("../core/protocol.js").Climate | null | undefined} */
    const climate = store.get("climate");
    const said = [
      ["temperature", climate?.temperature],
      ["humidity", climate?.relative_humidity],
      ["co2", climate?.co2],
    ]
      .filter(([, value]) => typeof value === "number")
      .map(([name, value]) => i18n.t(`climate.${name}`, { value }));
    setHidden(need("#climate"), said.length === 0);
    setText(need("#climate"), said.join(" · "));
  }

  const showHidden = () => drawHidden(map.layers(), i18n);

  function drawTexts() {
    map.setLanguage(i18n.t, i18n.blocks(...SAID_ON_MAPS));
    drawLayers(app, map, showBeliever);
    showHidden();
    showBeliever();
    drawFacts();
    drawCostmapAge();
    drawClimate();
    showFollowed(map.followed());
  }

  need("#map-measure").addEventListener("click", () =>
    map.setMeasuring(!map.isMeasuring()),
  );
  canvas.addEventListener("keydown", (event) => {
    if (event.key === "Escape") map.setMeasuring(false);
  });
  need("#layers").addEventListener("change", showHidden);
  wireZoom(map);
  document.addEventListener("iveg:follow", (event) => {
    map.follow(/** @type {CustomEvent<string>} */ (event).detail);
  });
  map.onPick(onPick);
  followCostmap(
    store,
    () => map.layers().some(({ name, on }) => name === "costmap" && on),
    map.believer,
  );
  followCoverage(store);
  createLegend(app);
  setInterval(onBeat, AGE_MS, drawCostmapAge);
  onThemeChange(() => map.setTheme());
  store.subscribe("robots/", showBeliever);
  store.subscribe("snapshot", drawTexts);
  store.subscribe("people", drawFacts);
  store.subscribe("coverage", drawFacts);
  store.subscribe("costmap", drawCostmapAge);
  store.subscribe("climate", drawClimate);
  i18n.onChange(drawTexts);
  drawTexts();
  for (const tool of all(".map-tools [disabled]")) tool.removeAttribute("disabled");
}

/** @param {LiveMap} map */
function wireZoom(map) {
  need("#map-fit").addEventListener("click", () => map.fit());
  need("#map-in").addEventListener("click", () => map.zoomBy(1));
  need("#map-out").addEventListener("click", () => map.zoomBy(-1));
}

/**
 * The share of the lanes within sight of cameras, as a text; blind when there is none.
 *
 * @param {import("../core/protocol.js").Coverage | undefined} coverage
 * @param {import("../core/i18n.js").I18n} i18n
 * @returns {{text: string, isBlind: boolean}}
 */
export function coverageSaid(coverage, i18n) {
  if (!coverage) return { text: i18n.t("map.coverage_unknown"), isBlind: true };
  const isOld =
    ageOf({ age_s: 0, receivedAtMs: coverage.receivedAtMs }) > COVERAGE_OLD_S;
  if (isOld) return { text: i18n.t("map.coverage_unknown"), isBlind: true };
  if (!coverage.cameras) return { text: i18n.t("map.coverage_blind"), isBlind: true };
  if (coverage.share === null) return { text: "", isBlind: false };
  const share = Math.floor(coverage.share * 100) / 100;
  return { text: i18n.t("map.coverage_share", { share }), isBlind: false };
}

/** @param {Person} person */
const isPresent = (person) => person.class === "person" && person.stage !== "last_seen";

/** @param {string} robotId */
function goToCard(robotId) {
  const card = all(".card").find(({ dataset }) => dataset.robot === robotId);
  card?.scrollIntoView({ block: "nearest", inline: "nearest" });
  const menu = /** @type {HTMLElement | null | undefined} */ (
    card?.querySelector('[data-part="menu"]')
  );
  menu?.focus({ preventScroll: true });
}

/**
 * @param {App} app
 * @param {LiveMap} map
 * @param {() => void} onBeliever
 */
function drawLayers({ store, i18n }, map, onBeliever) {
  const switches = map.layers().map(({ name, on }) => {
    const [choice, input] = makeChoice("checkbox", i18n.t(`map.layer.${name}`), on);
    input.addEventListener("change", () => map.setLayer(name, input.checked));
    return choice;
  });
  const spans = TRAIL_SPANS_S.map((seconds) => {
    const said = i18n.t("map.trail_span", { seconds });
    const [choice, input] = makeChoice("radio", said, map.trailSeconds() === seconds);
    input.name = "trail";
    input.addEventListener("change", () => map.setTrail(seconds));
    return choice;
  });
  const [shortcuts, keys] = makeChoice(
    "checkbox",
    i18n.t("map.shortcuts"),
    map.hasShortcuts(),
  );
  keys.addEventListener("change", () => map.setShortcuts(keys.checked));
  const ids = [null, ...store.robots().keys()];
  const beliefs = ids.map((robot) => {
    const key = robot === null ? "map.belief_all" : "map.belief_one";
    const isOn = map.believer() === robot;
    const [choice, input] = makeChoice("radio", i18n.t(key, { robot }), isOn);
    input.name = "belief";
    input.addEventListener("change", () => {
      map.setBeliever(robot);
      onBeliever();
    });
    return choice;
  });
  need("#layers").replaceChildren(
    ...switches,
    make("h3", "choices__head", i18n.t("map.belief")),
    ...beliefs,
    make("h3", "choices__head", i18n.t("map.trail_length")),
    ...spans,
    make("h3", "choices__head", i18n.t("map.keyboard")),
    shortcuts,
  );
}

/**
 * @param {"checkbox" | "radio"} type
 * @param {string} text
 * @param {boolean} isOn
 * @returns {[HTMLLabelElement, HTMLInputElement]}
 */
function makeChoice(type, text, isOn) {
  const choice = make("label", "choice");
  const input = make("input");
  input.type = type;
  input.checked = isOn;
  choice.append(input, text);
  return [choice, input];
}
