/**
 * The card of one robot: its pose, its speed, the age of both, and why it drives so.
 *
 * Ages are counted here, by the browser's clock, so that silence shows by itself.
 */

import { aboutAge, ageOf, linkOfRobot } from "../core/clock.js";
import {
  capitalised,
  isBlind,
  markOf,
  phrasesOf,
  situationOf,
} from "../core/situation.js";
import { slotOf } from "../core/slots.js";
import { createDetector } from "./detector.js";
import { all, setAttribute, setHidden, setText } from "./dom.js";
import { createGauge } from "./gauge.js";
import { createGoal } from "./goal.js";
import { drawReadings } from "./readings.js";
import { createRelease } from "./release.js";
import {
  agoSaid,
  certaintySaid,
  faultsSaid,
  gaugeSaid,
  isHeard,
  marginPartsSaid,
  marginSaid,
  readoutsSaid,
  taskSaid,
} from "./robot_texts.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/protocol.js").Robot} Robot */

export class RobotCard {
  #app;
  #card;
  #robotId;
  #parts;
  #fields;
  #ages;
  #gauge = createGauge();
  #release;
  #detector;
  #goal;

  /** @param {App} app @param {HTMLElement} card */
  constructor(app, card) {
    this.#app = app;
    this.#card = card;
    this.#robotId = String(card.dataset.robot);
    this.#parts = byName("part", card);
    this.#fields = byName("field", card);
    this.#ages = all("[data-age]", card);
    app.stops.putOn(this.#parts.stop, this.#robotId);
    this.#release = createRelease(app, card, this.#robotId);
    this.#detector = createDetector(app, card, this.#robotId);
    this.#goal = createGoal(app, card, this.#robotId);
    this.#parts.gauge.append(this.#gauge.svg, this.#gauge.bar);
    this.#parts.menu.addEventListener("click", (event) => this.#toggle(event));
    this.#parts.follow.addEventListener("click", () => this.#follow());
  }

  /** @param {Robot | undefined} robot */
  draw(robot) {
    const { i18n, dialogs } = this.#app;
    const isSmall = this.#card.parentElement?.hasAttribute("data-many") ?? false;
    this.#putRearm(isSmall);
    this.#drawHead(robot);
    this.#drawMode(robot);
    this.#drawAge(robot, isSmall);
    this.#gauge.draw(gaugeSaid(robot, this.#robotId, i18n));
    if (!isSmall) this.#drawDetails(robot);
    if (dialogs.isOpen(this.#panel)) this.#drawMargin(robot);
    this.#release.draw(robot);
    this.#detector.draw(robot);
    this.#goal.draw(this.#release.factsOf(robot));
  }

  /** A small card has no room for Release and Resume: they open its menu. */
  #putRearm(/** @type {boolean} */ isSmall) {
    const { rearm, strip, "panel-strip": panelStrip } = this.#parts;
    const home = isSmall ? panelStrip : strip;
    if (rearm.parentElement !== home) home.append(rearm);
  }

  get element() {
    return this.#card;
  }

  get #panel() {
    return /** @type {HTMLDialogElement} */ (this.#parts.panel);
  }

  /** @param {Event} event */
  #toggle(event) {
    const { dialogs } = this.#app;
    event.stopPropagation();
    if (dialogs.isOpen(this.#panel)) dialogs.close();
    else dialogs.open(this.#panel, this.#parts.menu);
  }

  #follow() {
    this.#app.dialogs.close();
    const detail = this.#robotId;
    document.dispatchEvent(new CustomEvent("iveg:follow", { detail }));
  }

  /** @param {Robot | undefined} robot */
  #drawHead(robot) {
    const { i18n } = this.#app;
    const { menu, shape, replay, refused } = this.#parts;
    const link = linkOfRobot(robot);
    setAttribute(this.#card, "data-link", link);
    setAttribute(this.#card, "data-mode", robot?.mode ?? "UNKNOWN");
    setAttribute(menu, "aria-label", i18n.t("release.open", { robot: this.#robotId }));
    const isThen = link === "LIVE" && document.body.hasAttribute("data-past");
    setText(this.#fields.link, i18n.t(`robot.link.${isThen ? "THEN" : link}`));
    setAttribute(shape, "data-slot", String(slotOf(this.#robotId)));
    setAttribute(shape, "data-drive", robot?.profile?.drive ?? "differential");
    setHidden(replay, !robot?.replay);
    setHidden(refused, !robot?.refused);
  }

  /** @param {Robot | undefined} robot */
  #drawMode(robot) {
    const { store, i18n } = this.#app;
    const { why, todo, causes, faults } = this.#parts;
    const { state } = store.connection;
    const situation = situationOf(robot, performance.now(), state);
    const phrases = phrasesOf(situation, i18n);
    setAttribute(this.#card, "data-level", situation.level);
    setText(this.#fields.mode, capitalised(phrases.said));
    const mark = markOf(situation);
    if (mark) setAttribute(causes, "data-cause", mark);
    else causes.removeAttribute("data-cause");
    setText(why, phrases.why);
    this.#drawMarks(robot, situation.kind);
    // Nothing is to be done about a moment that is past.
    const said = document.body.hasAttribute("data-past") ? "" : phrases.todo;
    setText(todo, said);
    this.#card.toggleAttribute("data-todo", said !== "");
    setText(faults, robot ? faultsSaid(robot, i18n).join(" · ") : "");
  }

  /**
   * What holds beside what is told first.
   *
   * @param {Robot | undefined} robot
   * @param {import("../core/situation.js").Kind} kind of what is told
   */
  #drawMarks(robot, kind) {
    const { store, i18n } = this.#app;
    const { "no-camera": camera, "battery-low": battery } = this.#parts;
    const { "battery-said": said } = this.#parts;
    setHidden(camera, kind === "blind" || !isBlind(robot));
    /** @type {import("../core/protocol.js").Alert[]} */
    const alerts = store.get("alerts") ?? [];
    const low = alerts.find(
      ({ key, robot_id, cleared_at }) =>
        key === "alert.battery_low" && robot_id === this.#robotId && !cleared_at,
    );
    setHidden(battery, kind === "battery" || !low);
    if (low) setText(said, i18n.t("situation.is.battery_low", low.slots));
  }

  /** @param {Robot | undefined} robot @param {boolean} isSmall */
  #drawAge(robot, isSmall) {
    const { i18n } = this.#app;
    const ageS = ageOf(robot);
    const said = Number.isFinite(ageS)
      ? aboutAge(robot, agoSaid(ageS, i18n), i18n)
      : "";
    const known = said || (isHeard(robot) ? i18n.t("robot.age_unknown") : "");
    if (!isSmall) for (const age of this.#ages) setText(age, known);
    setText(this.#fields.age, said);
  }

  /** Everything that a small card has no room for. @param {Robot | undefined} robot */
  #drawDetails(robot) {
    const { store, i18n } = this.#app;
    const { certainty, task, readings } = this.#parts;
    for (const [field, said] of readoutsSaid(robot, i18n))
      setText(this.#fields[field], said);
    setText(certainty, certaintySaid(store.detections().get(this.#robotId), i18n));
    setText(task, taskSaid(robot?.navigation?.task, i18n));
    drawReadings(readings, robot, i18n);
  }

  /** @param {Robot | undefined} robot */
  #drawMargin(robot) {
    const { i18n } = this.#app;
    setText(this.#parts.margin, marginSaid(robot, i18n));
    setText(this.#parts["margin-parts"], marginPartsSaid(robot, i18n));
  }
}

/**
 * The elements of a card that have a `data-part` or a `data-field`, by its value.
 *
 * @param {string} kind
 * @param {HTMLElement} card
 * @returns {Record<string, HTMLElement>}
 */
function byName(kind, card) {
  const found = all(`[data-${kind}]`, card);
  return Object.fromEntries(found.map((it) => [String(it.dataset[kind]), it]));
}
