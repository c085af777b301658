/**
 * The STOP controls: one a robot, one for the fleet, on every page.
 *
 * Each control exists once.  On a phone, and in a big fleet, a robot's control stands in
 * its card, else in the strip; it is moved, not copied, so there is one state to believe.
 * A panel that opens over the cards of a phone finds them in the strip.  What it says
 * comes from `stop_view.js`, what it sends goes through `press.js`.
 */

import { readApi } from "../core/api.js";
import { onBeat } from "../core/beat.js";
import { ageOf, linkOfRobot } from "../core/clock.js";
import { all, make, need, setAttribute, setHidden, setText } from "./dom.js";
import { createPresser } from "./press.js";
import { createLoudLines } from "./stop_loud.js";
import { createPlace } from "./stop_place.js";
import { since, viewOfFleet, viewOfRobot } from "./stop_view.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/protocol.js").Command} Command */
/** @typedef {import("./stop_view.js").View} View */

const TICK_MS = 100;
/** How long after `pointerup` a click still belongs to the same gesture (ms). */
const GESTURE_MS = 400;
/** A robot's state may be a frame older than its command's own topic (ms). */
const SETTLE_MS = 800;
const ACCEPTED_LIMIT_MS = 3000;
/** HTTP status of a session that may only stop; a stranger's is 401. */
const KNOWN_BUT_BLIND = 403;

/**
 * @param {App} app
 */
export function createStopPanel(app) {
  const { store, i18n, line } = app;
  const strip = need("#stops");
  const presser = createPresser(line, drawAll);
  const loud = createLoudLines(app);
  /** @type {Map<string, {command: Command, heardMs: number}>} newest stop by robot */
  const commands = new Map();
  /** @type {Map<string, HTMLElement>} */
  const controls = new Map();
  const isResuming = followOrders(store);
  const place = createPlace(strip, controls);
  const settle = createSettling(presser, line, controls, commands);
  /** Whether the server knows this page well enough to stop, though not to watch. */
  let isBlind = false;

  /** @param {string} robotId */
  function controlOf(robotId) {
    const known = controls.get(robotId);
    if (known) return known;
    const control = makeControl(robotId);
    strip.insertBefore(control, controls.get("fleet") ?? null);
    adopt(control);
    place();
    return control;
  }

  /** @param {HTMLElement} control */
  function adopt(control) {
    const id = String(control.dataset.stop);
    controls.set(id, control);
    for (const part of all("[data-i18n]", control)) part.removeAttribute("data-i18n");
    onPress(control, () => press(id === "fleet" ? null : id));
  }

  /** @param {string | null} robotId null = the whole fleet */
  function press(robotId) {
    presser.press(robotId);
    // Before the first activation browsers refuse it, and complain.
    if (navigator.userActivation?.isActive) navigator.vibrate?.(60);
  }

  /** @param {Command} command */
  function take(command) {
    if (command.kind !== "stop") return;
    const known = commands.get(command.robot_id)?.command;
    if (known && isOlder(command, known)) return;
    if (command.state === "RUNNING") commands.delete(command.robot_id);
    else commands.set(command.robot_id, { command, heardMs: performance.now() });
    settle(command);
    drawAll();
  }

  /** @param {import("../core/protocol.js").Robot} robot */
  function takeRobot(robot) {
    if (robot.stop) take({ ...robot.stop, receivedAtMs: robot.receivedAtMs });
    else forget(robot.robot_id);
    controlOf(robot.robot_id);
  }

  /** @param {string} robotId */
  function forget(robotId) {
    const known = commands.get(robotId);
    if (known && performance.now() - known.heardMs > SETTLE_MS)
      commands.delete(robotId);
  }

  /** @param {import("../core/protocol.js").Snapshot} snapshot */
  function restart(snapshot) {
    commands.clear();
    for (const command of snapshot.commands ?? []) take(command);
    for (const robot of snapshot.robots ?? []) takeRobot(robot);
    drawAll();
  }

  /** A session that is over may still stop for hours: the server says whether. */
  async function onConnection() {
    const isOver = store.connection.state === "signed-out";
    isBlind = isOver && (await readApi("robots")).status === KNOWN_BUT_BLIND;
    drawAll();
  }

  /** @param {string | null} robotId */
  function pendingOf(robotId) {
    const pending = presser.pending(robotId);
    // Without a line no command ever answers a press.
    const isOld =
      !isBlind &&
      pending?.accepted &&
      performance.now() - pending.atMs > ACCEPTED_LIMIT_MS;
    if (isOld) presser.settle(robotId);
    return isOld ? null : pending;
  }

  /** @param {string} robotId */
  function factsOf(robotId) {
    const robot = store.robots().get(robotId);
    const nowMs = performance.now();
    const fleetPress = pendingOf(null);
    return {
      robotId,
      connection: store.connection.state,
      isBlind,
      isResuming: isResuming(robotId),
      link: linkOfRobot(robot, nowMs),
      ageS: ageOf(robot, nowMs),
      command: commands.get(robotId)?.command ?? null,
      press: pendingOf(robotId) ?? fleetPress,
      nowMs,
      serverNowS: line.serverNow(),
    };
  }

  function drawAll() {
    const ids = [...controls.keys()].filter((id) => id !== "fleet");
    const robots = ids.map((id) => {
      const facts = factsOf(id);
      return { id, view: viewOfRobot(facts), link: facts.link, ageS: facts.ageS };
    });
    for (const { id, view } of robots) draw(id, view);
    const connection = store.connection.state;
    const fleet = { connection, press: pendingOf(null), nowMs: performance.now() };
    draw("fleet", viewOfFleet({ ...fleet, isBlind, robots }));
    const kept = [null, ...ids].map(presser.pending).filter(isKept);
    loud.draw(
      ids.map((id) => commands.get(id)?.command),
      kept,
    );
  }

  /**
   * @param {import("./press.js").Pending | null} press
   * @returns {press is import("./press.js").Pending}
   */
  function isKept(press) {
    return store.connection.state === "lost" && Boolean(press && !press.accepted);
  }

  /** @param {string} id @param {View} view */
  function draw(id, view) {
    const control = controlOf(id);
    const name = id === "fleet" ? i18n.t("stop.fleet_name") : id;
    setAttribute(control, "data-state", view.state);
    setText(need(".stop__words", control), i18n.t(view.key, view.slots));
    const who = need(".stop__who", control);
    setText(who, name);
    setHidden(who, view.state === "ready" || view.state === "late");
  }

  for (const control of all("[data-stop]")) adopt(control);
  place();
  onFleetKeys(() => press(null));
  store.subscribe("snapshot", restart);
  store.subscribe("commands/", take);
  store.subscribe("robots/", takeRobot);
  store.subscribe("connection", onConnection);
  i18n.onChange(drawAll);
  setInterval(onBeat, TICK_MS, drawAll);
  presser.goOn();
  drawAll();
  return {
    place,
    commandOf: (/** @type {string} */ id) => commands.get(id)?.command,
    isResuming,
  };
}

/**
 * Whether what a robot does next was asked for by a resume, and no release.
 *
 * @param {import("../core/store.js").Store} store
 * @returns {(robotId: string) => boolean}
 */
function followOrders(store) {
  /** @type {Map<string, string>} kind of the newest release or resume by robot */
  const kinds = new Map();
  store.subscribe("snapshot", () => kinds.clear());
  store.subscribe("commands/", ({ kind, robot_id }) => {
    if (kind !== "stop") kinds.set(robot_id, kind);
  });
  return (robotId) => kinds.get(robotId) === "resume";
}

/**
 * A command answers the press that asked for it; a press of the fleet is answered when
 * each robot has answered, not the first.
 *
 * @param {ReturnType<typeof createPresser>} presser
 * @param {App["line"]} line
 * @param {ReadonlyMap<string, HTMLElement>} controls by robot, and `fleet`
 * @param {ReadonlyMap<string, {heardMs: number}>} commands newest stop by robot
 * @returns {(command: Command) => void}
 */
function createSettling(presser, line, controls, commands) {
  /** @param {Command} command */
  function settleRobot({ robot_id, times }) {
    const pending = presser.pending(robot_id);
    if (!pending) return;
    const ageS = (performance.now() - pending.atMs) / 1000;
    const isNewer = since(times.requested, line.serverNow()) <= ageS + 1.5;
    if (pending.accepted || isNewer) presser.settle(robot_id);
  }

  function settleFleet() {
    const atMs = presser.pending(null)?.atMs;
    if (atMs === undefined) return;
    const robots = [...controls.keys()].filter((id) => id !== "fleet");
    const isAnswered = (/** @type {string} */ id) =>
      (commands.get(id)?.heardMs ?? Number.NEGATIVE_INFINITY) >= atMs;
    if (robots.every(isAnswered)) presser.settle(null);
  }

  return (command) => {
    settleRobot(command);
    settleFleet();
  };
}

/** @param {string} robotId */
function makeControl(robotId) {
  const control = make("button", "stop");
  control.type = "button";
  control.dataset.stop = robotId;
  control.append(make("span", "stop__who", robotId), make("span", "stop__words"));
  return control;
}

/**
 * One press for one gesture, whatever it is made of: finger or mouse down (not up: that
 * is a tenth of a second later), Enter, Space, or the bare click of an assistive tool.
 *
 * @param {HTMLElement} control
 * @param {() => void} press
 */
export function onPress(control, press) {
  let isGesture = false;
  control.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    isGesture = true;
    press();
  });
  for (const end of ["pointerup", "pointercancel"]) {
    addEventListener(end, () => {
      setTimeout(() => {
        isGesture = false;
      }, GESTURE_MS);
    });
  }
  control.addEventListener("click", () => {
    if (!isGesture) press();
    isGesture = false;
  });
  control.addEventListener("keydown", (event) => {
    if (!isPressKey(event)) return;
    // The browser's own click would come late (Space) or again and again (Enter).
    event.preventDefault();
    if (!event.repeat) press();
  });
  control.addEventListener("keyup", (event) => {
    if (isPressKey(event)) event.preventDefault();
  });
}

/** @param {KeyboardEvent} event */
const isPressKey = (event) =>
  (event.key === "Enter" || event.key === " ") && !event.ctrlKey && !event.altKey;

/**
 * `Ctrl+.` anywhere on the page, a field with the focus included.
 *
 * @param {() => void} press
 */
function onFleetKeys(press) {
  const listener = (/** @type {KeyboardEvent} */ event) => {
    if (!event.ctrlKey || (event.key !== "." && event.code !== "Period")) return;
    event.preventDefault();
    event.stopPropagation();
    if (!event.repeat) press();
  };
  addEventListener("keydown", listener, { capture: true });
}

/**
 * Whether a command belongs to an episode before the known one.  Times of one server in
 * one format compare as text; within an episode what arrives last is newest.
 *
 * @param {Command} command
 * @param {Command} known
 */
function isOlder(command, known) {
  if (command.command_id === known.command_id) return false;
  const a = command.times.requested ?? "";
  const b = known.times.requested ?? "";
  return a < b;
}
