/**
 * One card a robot: where it is, how fast, how old that is, and why it drives so.
 *
 * Ages are counted here, by the browser's clock, so that silence shows by itself.
 */

import { onBeat } from "../core/beat.js";
import { aboutAge, ageOf, linkOfRobot } from "../core/clock.js";
import { all, make, need, needPart, setAttribute, setHidden, setText } from "./dom.js";
import { createDrill } from "./drill.js";
import { createGauge, readingOf } from "./gauge.js";
import { readingsOf } from "./readings.js";
import { createRelease } from "./release.js";
import { faultsSaid, marginSaid, modeSaid, taskSaid, whySaid } from "./robot_texts.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/protocol.js").Margin} Margin */
/** @typedef {import("../core/protocol.js").Robot} Robot */

const TICK_MS = 200;
/** Cards that nobody sees are drawn at every so many ticks: a second. */
const UNSEEN_TICKS = 5;
/** More cards than this are small ones; the rest of each is in its menu. */
const ROOMY = 2;
const DEGREES = 180 / Math.PI;

/** @param {App} app */
export function createRobotsPanel(app) {
  const { store, i18n } = app;
  const place = need("#robots");
  /** @type {Map<string, ReturnType<typeof createCard>>} */
  const cards = new Map();
  /** @type {Map<string, string>} */
  const did = new Map();
  const sight = createSight();
  let ticks = 0;

  /** @param {string} robotId */
  function cardOf(robotId) {
    const known = cards.get(robotId);
    if (known) return known;
    const element = findElement(robotId) ?? cloneElement(robotId);
    const card = createCard(app, element);
    sight.watch(robotId, element);
    cards.set(robotId, card);
    place.toggleAttribute("data-many", cards.size > ROOMY);
    app.stops.place();
    return card;
  }

  /** @param {string} robotId */
  function findElement(robotId) {
    return all(".card", place).find((card) => card.dataset.robot === robotId);
  }

  /** @param {string} robotId */
  function cloneElement(robotId) {
    const template = /** @type {HTMLTemplateElement} */ (need("#robot-card"));
    const copy = /** @type {DocumentFragment} */ (template.content.cloneNode(true));
    const card = need(".card", copy);
    card.dataset.robot = robotId;
    setAttribute(card, "aria-label", robotId);
    setText(needPart("name", card), robotId);
    setText(needPart("panel-name", card), robotId);
    need("[data-release]", card).dataset.release = robotId;
    need("[data-resume]", card).dataset.resume = robotId;
    place.append(card);
    return card;
  }

  function drawAll() {
    for (const robotId of store.robots().keys()) cardOf(robotId);
    setHidden(need("#robots-empty"), cards.size > 0);
    const none = store.get("snapshot") ? "robot.none" : "rows.loading";
    setText(need("#robots-empty"), i18n.t(none));
    for (const [robotId, card] of cards) card.draw(store.robots().get(robotId));
  }

  function tick() {
    ticks += 1;
    if (ticks % UNSEEN_TICKS === 0) return drawAll();
    for (const robot of store.robots().values()) drawSeen(robot);
  }

  /**
   * What it does is shown at once; where it is with the next tick.
   *
   * @param {Robot} robot
   */
  function take(robot) {
    const does = `${robot.mode} ${robot.stop?.state} ${robot.speed_limit?.reason}`;
    if (did.get(robot.robot_id) !== does) drawSeen(robot);
    did.set(robot.robot_id, does);
  }

  /** @param {Robot} robot */
  function drawSeen(robot) {
    const card = cardOf(robot.robot_id);
    if (sight.isSeen(robot.robot_id)) card.draw(robot);
  }

  for (const card of all(".card", place)) cardOf(String(card.dataset.robot));
  store.subscribe("robots/", take);
  store.subscribe("snapshot", drawAll);
  i18n.onChange(drawAll);
  setInterval(onBeat, TICK_MS, tick);
  drawAll();
}

/** Which cards are within the screen, or may be: a fleet has more than fit. */
function createSight() {
  /** @type {Set<string>} */
  const unseen = new Set();
  const observer = new IntersectionObserver((changes) => {
    for (const { target, isIntersecting } of changes) {
      const robotId = String(/** @type {HTMLElement} */ (target).dataset.robot);
      if (isIntersecting) unseen.delete(robotId);
      else unseen.add(robotId);
    }
  });
  return {
    /** @param {string} robotId @param {HTMLElement} card its `data-robot` is the id */
    watch(robotId, card) {
      unseen.delete(robotId);
      observer.observe(card);
    },
    /** @param {string} robotId */
    isSeen: (robotId) => !unseen.has(robotId),
  };
}

/**
 * @param {App} app
 * @param {HTMLElement} card
 */
function createCard(app, card) {
  const { store, i18n, dialogs } = app;
  /** @type {Map<string, HTMLElement>} */
  const parts = new Map();
  const robotId = String(card.dataset.robot);
  const gauge = createGauge();
  needPart("gauge", card).append(gauge.svg, gauge.bar);
  const release = createRelease(app, card, robotId);
  const drill = createDrill(app, card, robotId);
  const menu = needPart("menu", card);
  const panel = /** @type {HTMLDialogElement} */ (needPart("panel", card));
  menu.addEventListener("click", (event) => {
    event.stopPropagation();
    if (dialogs.isOpen(panel)) dialogs.close();
    else dialogs.open(panel, menu);
  });
  needPart("follow", card).addEventListener("click", () => {
    dialogs.close();
    document.dispatchEvent(new CustomEvent("iveg:follow", { detail: robotId }));
  });
  const fields = Object.fromEntries(
    all("[data-field]", card).map((field) => [field.dataset.field, field]),
  );
  const ages = all("[data-age]", card);
  const isSmall = () => card.parentElement?.hasAttribute("data-many") ?? false;

  /** @param {string} name */
  function partOf(name) {
    const part = parts.get(name) ?? needPart(name, card);
    parts.set(name, part);
    return part;
  }

  /** @param {Robot | undefined} robot */
  function draw(robot) {
    const ageS = ageOf(robot);
    const link = linkOfRobot(robot);
    setAttribute(card, "data-link", link);
    setAttribute(card, "data-mode", robot?.mode ?? "UNKNOWN");
    setAttribute(menu, "aria-label", i18n.t("release.open", { robot: robotId }));
    setText(fields.link, i18n.t(`robot.link.${link}`));
    const shape = partOf("shape");
    setAttribute(shape, "data-slot", String(store.slotOf(robotId)));
    setAttribute(shape, "data-drive", robot?.profile?.drive ?? "differential");
    setHidden(partOf("replay"), !robot?.replay);
    drawMode(robot);
    drawAge(robot, ageS);
    drawGauge(robot);
    if (!isSmall()) drawDetails(robot);
    if (dialogs.isOpen(panel)) drawMarginParts(robot?.margin ?? null);
    release.draw(robot);
    drill.draw(release.factsOf(robot));
  }

  /** What a small card has no room for. @param {Robot | undefined} robot */
  function drawDetails(robot) {
    drawReadouts(robot);
    setText(partOf("certainty"), certaintyOf(robotId));
    drawMargin(robot?.margin ?? null);
    drawTask(robot);
    drawReadings(robot);
  }

  /** @param {Robot | undefined} robot */
  function drawMode(robot) {
    setText(fields.mode, modeSaid(robot, i18n, app.stops.isResuming(robotId)));
    setText(partOf("why"), whySaid(robot, i18n));
    const faults = robot ? faultsSaid(robot, i18n).join(" · ") : "";
    setHidden(partOf("faults"), !faults);
    setText(partOf("faults"), faults);
  }

  /** @param {Robot | undefined} robot @param {number} ageS */
  function drawAge(robot, ageS) {
    const said = Number.isFinite(ageS) ? aboutAge(robot, agoOf(ageS), i18n) : "";
    if (!isSmall()) for (const age of ages) setText(age, said);
    setText(fields.age, said);
  }

  /** @param {Robot | undefined} robot */
  function drawReadouts(robot) {
    const { pose, twist } = robot ?? {};
    readout("x", pose?.x, 2, "m");
    readout("y", pose?.y, 2, "m");
    readout("yaw", pose && pose.yaw * DEGREES, 1, "deg");
    readout("v", twist?.linear, 2, "ms");
    readout("w", twist?.angular, 2, "rads");
  }

  /**
   * @param {string} field
   * @param {number | null | undefined} value
   * @param {number} decimals
   * @param {string} unit
   */
  function readout(field, value, decimals, unit) {
    const said =
      value === null || value === undefined
        ? "—"
        : `${i18n.number(value, decimals)} ${i18n.t(`robot.unit.${unit}`)}`;
    setText(fields[field], said);
  }

  /** @param {number} ageS */
  function agoOf(ageS) {
    const key = ageS < 10 ? "robot.ago" : "robot.ago_long";
    return i18n.t(key, { age: ageS });
  }

  /** @param {Robot | undefined} robot */
  function drawGauge(robot) {
    const { speed, max, factor } = readingOf(robot);
    const limit = (factor ?? 1) * max;
    const isKnown = speed !== null;
    gauge.draw({
      speed,
      max,
      factor,
      name: i18n.t("robot.gauge", { robot: robotId }),
      said: isKnown
        ? i18n.t("robot.gauge_value", { speed, max, limit })
        : i18n.t("robot.speed_unknown"),
      limitSaid: factor === null ? "" : i18n.t("robot.limit", { limit }),
      speedSaid: isKnown ? i18n.number(Math.abs(speed), 2) : "—",
    });
  }

  /** How sure its detector is of the surest thing in its newest look. @param {string} id */
  function certaintyOf(id) {
    const look = store.looks().get(id);
    if (!look || ageOf(look) > 3) return i18n.t("robot.certainty_old");
    const [best] = [...look.items].sort((a, b) => b.probability - a.probability);
    if (!best) return i18n.t("robot.certainty_none");
    const key = best.confident ? "robot.certainty_value" : "robot.certainty_faint";
    const slots = { class: best.class ?? best.class_id, confidence: best.probability };
    return i18n.t(key, slots);
  }

  /** The least margin to a person. @param {Margin | null} margin */
  function drawMargin(margin) {
    setAttribute(partOf("margin-line"), "data-band", margin?.band ?? "none");
    setText(partOf("margin"), marginSaid(margin, i18n));
  }

  /** @param {Margin | null} margin */
  function drawMarginParts(margin) {
    const parts = partOf("margin-parts");
    setHidden(parts, margin === null);
    if (!margin) return;
    const slots = { ...margin, ...margin.parts };
    setText(parts, i18n.t("robot.margin_parts", slots));
  }

  /** @param {Robot | undefined} robot */
  function drawTask(robot) {
    setText(partOf("task"), taskSaid(robot?.navigation?.task, i18n));
  }

  /** @param {Robot | undefined} robot */
  function drawReadings(robot) {
    const place = partOf("readings");
    const readings = readingsOf(robot, i18n);
    while (place.children.length > readings.length) place.lastElementChild?.remove();
    while (place.children.length < readings.length) {
      const line = make("p", "card__line");
      line.append(make("span", "card__label"), " ", make("span"));
      place.append(line);
    }
    readings.forEach(({ label, said }, i) => {
      const [name, value] = place.children[i].children;
      setText(name, label);
      setText(value, said);
    });
  }

  return { draw };
}
