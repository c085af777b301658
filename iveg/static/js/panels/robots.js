/**
 * The cards of the fleet, one for each robot; those on the screen are drawn often.
 */

import { onBeat } from "../core/beat.js";
import { situationOf } from "../core/situation.js";
import { createCardOrder } from "./card_order.js";
import { all, need, needPart, setAttribute, setHidden, setText } from "./dom.js";
import { RobotCard } from "./robot_card.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/protocol.js").Robot} Robot */

const TICK_MS = 200;
/** Ticks from one drawing of the cards outside of the screen to the next: a second. */
const UNSEEN_TICKS = 5;
/** More cards than this are small ones, with the details in the menu of each. */
const ROOMY = 2;

/** @param {App} app */
export function createRobotsPanel(app) {
  const { store, i18n } = app;
  const place = need("#robots");
  /** @type {Map<string, RobotCard>} */
  const cards = new Map();
  /** @type {Map<string, string>} */
  const did = new Map();
  const sight = createSight();
  const order = createCardOrder(place);
  let ticks = 0;

  /** @param {string} robotId */
  function cardOf(robotId) {
    const known = cards.get(robotId);
    if (known) return known;
    const element = findElement(robotId) ?? cloneElement(robotId);
    const card = new RobotCard(app, element);
    sight.watch(robotId, element);
    cards.set(robotId, card);
    place.toggleAttribute("data-many", cards.size > ROOMY);
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
    sort();
    if (ticks % UNSEEN_TICKS === 0) return drawAll();
    for (const robot of store.robots().values()) drawSeen(robot);
  }

  function sort() {
    const fleet = [...store.robots()].map(([id, robot]) => {
      return { id, card: cardOf(id).element, situation: situationOf(robot) };
    });
    order.sort(fleet);
  }

  /**
   * A change of what the robot does is shown at once, its pose with the next tick.
   *
   * @param {Robot} robot
   */
  function take(robot) {
    const { level, state, why } = robot.situation;
    const does = `${level} ${state} ${why} ${robot.stop?.state}`;
    if (did.get(robot.robot_id) !== does) drawSeen(robot);
    did.set(robot.robot_id, does);
  }

  /** @param {Robot} robot */
  function drawSeen(robot) {
    const card = cardOf(robot.robot_id);
    if (sight.isSeen(robot.robot_id)) card.draw(robot);
  }

  /** A row that snaps may leave what has just got the focus out of sight. */
  place.addEventListener("focusin", ({ target }) => {
    const card = /** @type {HTMLElement} */ (target).closest(".card");
    if (card) place.scrollLeft = /** @type {HTMLElement} */ (card).offsetLeft;
  });
  for (const card of all(".card", place)) cardOf(String(card.dataset.robot));
  store.subscribe("robots/", take);
  store.subscribe("snapshot", drawAll);
  i18n.onChange(drawAll);
  setInterval(onBeat, TICK_MS, tick);
  drawAll();
}

/** Which cards are on the screen, or may be: a large fleet has more than fit. */
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
