/**
 * The STOP controls: one for each robot and one for the fleet, on every page.
 *
 * A robot's control stands in the strip of every page, in the fleet's order, and on its
 * card.  Neither ever moves, and both are drawn of one view in one go, so that there is
 * one state to believe.  `stop_view.js` says what a control shows, `press.js` sends what
 * is pressed.
 */

import { readApi } from "../core/api.js";
import { onBeat } from "../core/beat.js";
import { ageOf, linkOfRobot } from "../core/clock.js";
import { all, make, need, setAttribute, setHidden, setText } from "./dom.js";
import { NewestStops } from "./newest_stops.js";
import { createPresser } from "./press.js";
import { onFleetKeys, onPress } from "./stop_gesture.js";
import { createLoudLines } from "./stop_loud.js";
import { createPlace } from "./stop_place.js";
import { since, viewOfFleet, viewOfRobot } from "./stop_view.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/protocol.js").Command} Command */
/** @typedef {import("../core/protocol.js").Robot} Robot */
/** @typedef {import("./press.js").Pending} Pending */
/** @typedef {import("./stop_view.js").View} View */

const TICK_MS = 100;
const ACCEPTED_LIMIT_MS = 3000;
/** HTTP status of a session that may only stop; a stranger's is 401. */
const KNOWN_BUT_BLIND = 403;

export class StopPanel {
  #app;
  #presser;
  #loud;
  #stops = new NewestStops();
  #place;
  /** @type {Map<string, HTMLElement[]>} by robot, and `fleet`: strip first, then card */
  #controls = new Map();
  /** Whether the session is over for watching, though not for stopping. */
  #isBlind = false;

  /**
   * @param {App} app
   * @param {Parameters<typeof createPresser>[2]} [send] HTTP; tests pass their own
   */
  constructor(app, send) {
    const { store, i18n, line } = app;
    const drawAll = () => this.#drawAll();
    this.#app = app;
    this.#presser = createPresser(line, drawAll, send);
    this.#loud = createLoudLines(app);
    this.#place = createPlace(() => this.#robotIds().length);
    for (const control of all("[data-stop]", need("#stops"))) this.#adopt(control);
    this.#place();
    onFleetKeys(() => this.#press(null));
    store.subscribe("snapshot", (snapshot) => this.#restart(snapshot));
    store.subscribe("commands/", (command) => this.#take(command));
    store.subscribe("robots/", (robot) => this.#takeRobot(robot));
    store.subscribe("connection", () => this.#onConnection());
    i18n.onChange(drawAll);
    setInterval(onBeat, TICK_MS, drawAll);
    this.#presser.goOn();
    this.#drawAll();
    // From here on `early.js` hears nothing, and what it has heard goes on here.
    document.body.toggleAttribute("data-loaded", true);
  }

  /** The newest STOP of a robot. @param {string} robotId */
  commandOf(robotId) {
    return this.#stops.commandOf(robotId);
  }

  /** @param {string} robotId */
  isResuming(robotId) {
    return this.#stops.isResuming(robotId);
  }

  /** @param {HTMLElement} control */
  #adopt(control) {
    const id = String(control.dataset.stop);
    this.#controls.set(id, [...(this.#controls.get(id) ?? []), control]);
    for (const part of all("[data-i18n]", control)) part.removeAttribute("data-i18n");
    control.removeAttribute("aria-busy");
    onPress(control, () => this.#press(id === "fleet" ? null : id));
  }

  /** @param {string | null} robotId null = the whole fleet */
  #press(robotId) {
    this.#presser.press(robotId);
    // Before the first activation browsers refuse it, and complain.
    if (navigator.userActivation?.isActive) navigator.vibrate?.(60);
  }

  /** @param {string} robotId */
  #controlsOf(robotId) {
    const known = this.#controls.get(robotId);
    if (known) return known;
    const control = makeControl(robotId);
    need("#stops-robots").append(control);
    this.#adopt(control);
    this.#place();
    return [control];
  }

  /** A robot's control on its card. @param {HTMLElement} slot @param {string} robotId */
  putOn(slot, robotId) {
    this.#controlsOf(robotId);
    const control = makeControl(robotId);
    slot.append(control);
    this.#adopt(control);
    this.#drawAll();
  }

  #robotIds() {
    return [...this.#controls.keys()].filter((id) => id !== "fleet");
  }

  /** @param {import("../core/protocol.js").Snapshot} snapshot */
  #restart(snapshot) {
    this.#stops.clear();
    for (const command of snapshot.commands ?? []) this.#take(command);
    for (const robot of snapshot.robots ?? []) this.#takeRobot(robot);
    this.#drawAll();
  }

  /** @param {Command} command */
  #take(command) {
    if (!this.#stops.take(command)) return;
    this.#settleRobot(command);
    this.#settleFleet();
    this.#drawAll();
  }

  /** @param {Robot} robot */
  #takeRobot({ robot_id, stop, receivedAtMs }) {
    if (stop) this.#take({ ...stop, receivedAtMs });
    else this.#stops.forget(robot_id);
    this.#controlsOf(robot_id);
  }

  /** A command answers the press that asked for it. @param {Command} command */
  #settleRobot({ robot_id, times }) {
    const pending = this.#presser.pending(robot_id);
    if (!pending) return;
    const ageS = (performance.now() - pending.atMs) / 1000;
    const isNewer = since(times.requested, this.#app.line.serverNow()) <= ageS + 1.5;
    if (pending.accepted || isNewer) this.#presser.settle(robot_id);
  }

  /** A press of the fleet is answered when every robot has answered, not the first. */
  #settleFleet() {
    const atMs = this.#presser.pending(null)?.atMs;
    if (atMs === undefined) return;
    const isAnswered = (/** @type {string} */ id) => this.#stops.heardMs(id) >= atMs;
    if (this.#robotIds().every(isAnswered)) this.#presser.settle(null);
  }

  /** A session that is over may still stop for hours: the server says whether. */
  async #onConnection() {
    const isOver = this.#app.store.connection.state === "signed-out";
    this.#isBlind = isOver && (await readApi("robots")).status === KNOWN_BUT_BLIND;
    this.#drawAll();
  }

  /** @param {string | null} robotId */
  #pendingOf(robotId) {
    const pending = this.#presser.pending(robotId);
    // Without a connection no command ever answers a press.
    const isOld =
      !this.#isBlind &&
      pending?.accepted &&
      performance.now() - pending.atMs > ACCEPTED_LIMIT_MS;
    if (isOld) this.#presser.settle(robotId);
    return isOld ? null : pending;
  }

  /** @param {string} robotId */
  #factsOf(robotId) {
    const { store, line } = this.#app;
    const robot = store.robots().get(robotId);
    const nowMs = performance.now();
    const fleetPress = this.#pendingOf(null);
    return {
      robotId,
      connection: store.connection.state,
      isBlind: this.#isBlind,
      isResuming: this.isResuming(robotId),
      link: linkOfRobot(robot, nowMs),
      ageS: ageOf(robot, nowMs),
      command: this.commandOf(robotId) ?? null,
      press: this.#pendingOf(robotId) ?? fleetPress,
      nowMs,
      serverNowS: line.serverNow(),
    };
  }

  #drawAll() {
    const ids = this.#robotIds();
    const robots = ids.map((id) => {
      const facts = this.#factsOf(id);
      return { id, view: viewOfRobot(facts), link: facts.link, ageS: facts.ageS };
    });
    for (const { id, view } of robots) this.#draw(id, view);
    const connection = this.#app.store.connection.state;
    const press = this.#pendingOf(null);
    const fleet = { connection, press, nowMs: performance.now(), robots };
    this.#draw("fleet", viewOfFleet({ ...fleet, isBlind: this.#isBlind }));
    const presses = [null, ...ids].map(this.#presser.pending);
    const kept = connection === "lost" ? presses.filter(isUntaken) : [];
    this.#loud.draw(
      ids.map((id) => this.commandOf(id)),
      kept,
    );
  }

  /** @param {string} id @param {View} view */
  #draw(id, view) {
    const { i18n } = this.#app;
    const said = i18n.t(view.key, view.slots);
    for (const control of this.#controlsOf(id)) {
      setAttribute(control, "data-state", view.state);
      const { label, who } = partsOf(control);
      setText(label, said);
      setText(who, id === "fleet" ? i18n.t("stop.fleet_name") : id);
      setHidden(who, view.state === "ready" || view.state === "late");
    }
  }
}

/** @type {WeakMap<HTMLElement, {label: HTMLElement, who: HTMLElement}>} */
const parts = new WeakMap();

/** Asked for five times a second of each control. @param {HTMLElement} control */
function partsOf(control) {
  const known = parts.get(control);
  if (known) return known;
  const found = {
    label: need(".stop__label", control),
    who: need(".stop__who", control),
  };
  parts.set(control, found);
  return found;
}

/** @param {Pending | null} press @returns {press is Pending} */
function isUntaken(press) {
  return Boolean(press && !press.accepted);
}

/** @param {string} robotId */
function makeControl(robotId) {
  const control = make("button", "stop");
  control.type = "button";
  control.dataset.stop = robotId;
  control.append(make("span", "stop__who", robotId), make("span", "stop__label"));
  return control;
}
