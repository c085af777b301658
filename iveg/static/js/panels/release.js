/**
 * Releasing a robot and letting it drive again: two steps, never one, and never the
 * STOP control pressed again.
 *
 * A release names every hold on the screen, takes two seconds of pressing, and needs a
 * fresh report that proves a standstill.  The server checks all of it again; this page
 * explains it.
 */

import { sendApi } from "../core/api.js";
import { ageOf } from "../core/clock.js";
import { LIMITS } from "../core/limits.js";
import {
  fill,
  make,
  need,
  needPart,
  setAttribute,
  setDisabled,
  setText,
} from "./dom.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/protocol.js").Robot} Robot */
/** @typedef {import("../core/protocol.js").Command} Command */
/** @typedef {import("../core/protocol.js").Hold} Hold */

const HOLD_MS = 2000;
/** How far a finger that rests may roll: a fingertip is about this wide. */
const SLIP_PX = 40;
const OTHER = "release.failed.other";
const RELEASERS = new Set(["operator", "admin"]);

/**
 * @param {App} app
 * @param {HTMLElement} card
 * @param {string} robotId
 */
export function createRelease(app, card, robotId) {
  const { store, i18n, stops } = app;
  const releaseButton = /** @type {HTMLButtonElement} */ (need("[data-release]", card));
  const resumeButton = /** @type {HTMLButtonElement} */ (need("[data-resume]", card));
  const result = needPart("result", card);
  /** @type {Robot | undefined} */
  let shown;
  /** @type {string | null} key of the newest answer, and its slots */
  let outcome = null;
  let status = 0;
  let isBusy = false;
  /** @type {Command | undefined} the newest release or resume, as it goes on */
  let order;

  /** @param {Robot | undefined} robot */
  function draw(robot) {
    shown = robot;
    const facts = factsOf(robot);
    const mayRelease = whyNotRelease(facts);
    const mayResume = whyNotResume(facts);
    setDisabled(releaseButton, isBusy || mayRelease !== "ok");
    setDisabled(resumeButton, isBusy || mayResume !== "ok");
    const named = { robot: robotId };
    setAttribute(releaseButton, "aria-label", i18n.t("release.button", named));
    setAttribute(resumeButton, "aria-label", i18n.t("release.resume", named));
    // What to look for before the robot drives must not be cut short, and of one that
    // drives the newest order is history.
    const isTold = isHeld(robot) && mayResume !== "ok";
    setText(result, isTold ? outcomeSaid() : "");
    setText(needPart("release-why", card), whySaid(robot, mayRelease, mayResume));
    const panel = /** @type {HTMLDialogElement} */ (needPart("panel", card));
    if (!panel.open) return;
    drawFacts(robot);
    drawHolds(robot);
  }

  /**
   * The sentence below the two buttons: what a release lifts, or why there is none.
   *
   * @param {Robot | undefined} robot
   * @param {string} mayRelease @param {string} mayResume
   */
  function whySaid(robot, mayRelease, mayResume) {
    if (isBusy) return i18n.t("release.why.busy");
    // Of a robot that drives there is nothing to say, on every card and all the time.
    if (!isHeld(robot) && mayRelease !== "signed_out") return "";
    if (mayResume === "ok") return i18n.t("release.why.ready");
    if (mayRelease !== "ok") return i18n.t(`release.why.${mayRelease}`);
    const sources = new Set(robot?.holds.map(({ source }) => source));
    const holds = [...sources].map((it) => i18n.t(`release.hold_source.${it}`));
    return i18n.t("release.lifts", { holds: holds.join(", ") });
  }

  function outcomeSaid() {
    if (!order) return outcome ? i18n.t(outcome, { status }) : "";
    const { key, slots } = saidOfOrder(order);
    return i18n.t(key, slots);
  }

  /** @param {Command} command */
  function take(command) {
    if (command.robot_id !== robotId || command.kind === "stop") return;
    order = command;
    draw(shown);
  }

  /** @param {Robot | undefined} robot */
  function factsOf(robot) {
    return {
      connection: store.connection.state,
      role: document.body.dataset.role ?? "",
      robot,
      ageS: ageOf(robot),
      command: stops.commandOf(robotId),
    };
  }

  /** @param {Robot | undefined} robot */
  function drawFacts(robot) {
    const facts = [
      robot?.profile && i18n.t("robot.profile", robot.profile),
      robot && !robot.applied && i18n.t("robot.no_laser_tracks"),
      robot?.transport && i18n.t(`robot.transport.${robot.transport}`),
      robot?.cmd_status && i18n.t("robot.agent", { status: robot.cmd_status }),
      robot?.clock_offset_s && i18n.t("robot.offset", { offset: robot.clock_offset_s }),
    ];
    setText(needPart("facts", card), facts.filter(Boolean).join(" · "));
  }

  /** @param {Robot | undefined} robot */
  function drawHolds(robot) {
    const holds = robot?.holds.length ? robot.holds : [null];
    fill(needPart("holds", card), holds, makeHold, drawHold);
  }

  /** @param {Element} item @param {Hold | null} hold null: the robot has none */
  function drawHold(item, hold) {
    const key = hold ? `release.hold_source.${hold.source}` : "release.no_holds";
    setText(need("b", item), i18n.t(key));
    setText(need("small", item), hold ? ackSaid(hold) : "");
    setAttribute(item, "title", hold?.id ?? "");
  }

  /** Who may lift a hold, and who asked for it. @param {Hold} hold */
  function ackSaid({ ack, source }) {
    const said = i18n.t(`release.hold_ack.${ack}`);
    const who = stops.commandOf(robotId)?.requesters.join(", ");
    return source === "iveg" && who
      ? `${said} · ${i18n.t("release.held_by", { who })}`
      : said;
  }

  /** @param {string} verb @param {object} body */
  async function send(verb, body) {
    isBusy = true;
    order = undefined;
    draw(shown);
    const path = `robots/${encodeURIComponent(robotId)}/${verb}`;
    const answer = await sendApi("POST", path, body);
    ({ status } = answer);
    isBusy = false;
    const isTaken = status === 202 || status === 200;
    const known = `release.failed.${status}`;
    return say(isTaken ? "release.sent" : i18n.has(known) ? known : OTHER);
  }

  /** @param {string} key */
  function say(key) {
    outcome = key;
    draw(shown);
  }

  onHold(releaseButton, {
    // Exactly the holds that stood there when the finger came down: a later hold makes
    // the server refuse.
    begin: () => (shown?.holds ?? []).map(({ id }) => id),
    done: (holds) => send("release", { holds }),
    refused: () => {
      order = undefined;
      say("release.failed.409");
    },
  });
  resumeButton.addEventListener("click", () => send("resume", {}));
  store.subscribe("commands/", take);
  return { draw, factsOf };
}

function makeHold() {
  const item = make("li");
  item.append(make("b"), make("small"));
  return item;
}

/**
 * @typedef {{connection: import("../core/store.js").ConnectionState, role: string, robot: Robot | undefined, ageS: number,
 *   command: Command | undefined}} Facts
 */

/**
 * The outcome of a release or resume.
 *
 * @param {Command} order
 * @returns {import("../types.js").Sentence}
 */
export function saidOfOrder({ state, reason }) {
  if (state === "RELEASING") return { key: "release.sent", slots: {} };
  if (state === "EXPIRED") return { key: "release.unconfirmed", slots: {} };
  if (reason === null) return { key: "release.confirmed", slots: {} };
  if (state === "REPLACED") return { key: "release.replaced", slots: {} };
  return { key: "release.refused", slots: { why: reason } };
}

/** Key of the reason why a release cannot be asked for, or `ok`. @param {Facts} facts */
export function whyNotRelease(facts) {
  const { robot } = facts;
  const common = whyNotAtAll(facts);
  if (common) return common;
  if (!robot?.holds.length) return "no_hold";
  if (!robot.holds.some(({ ack }) => ack === "remote")) {
    return robot.holds.some(({ ack }) => ack === "local") ? "local_hold" : "auto_hold";
  }
  return isStanding(facts) ? "ok" : "not_standing";
}

/** @param {Facts} facts */
export function whyNotResume(facts) {
  const common = whyNotAtAll(facts);
  if (common) return common;
  const { robot, command } = facts;
  if (!robot || robot.holds.length) return "not_ready";
  if (command) return command.state === "READY" ? "ok" : "not_ready";
  return robot.mode === "STOPPED" ? "ok" : "not_ready";
}

/** Key of a reason against release and resume alike, or null. @param {Facts} facts */
export function whyNotAtAll({ connection, role, ageS }) {
  if (connection === "signed-out") return "signed_out";
  if (connection !== "open") return "no_link";
  if (!RELEASERS.has(role)) return "role";
  return ageS > LIMITS.report_fresh_s ? "not_fresh" : null;
}

/** @param {Robot | undefined} robot */
const isHeld = (robot) => robot?.mode === "STOPPED" || Boolean(robot?.holds.length);

/** @param {Facts} facts */
function isStanding({ robot, command }) {
  if (command) return command.state === "STANDING";
  const twist = robot?.twist;
  return (
    robot?.mode === "STOPPED" &&
    Math.abs(twist?.linear ?? 1) < LIMITS.standing_speed &&
    Math.abs(twist?.angular ?? 1) < LIMITS.standing_speed
  );
}

/**
 * A button that is held down for two seconds, by finger, mouse or key.
 *
 * The pointer is captured: a line that comes or goes above the button moves it away from
 * under a finger that rests, and that must not end the hold.  A finger that moves does.
 *
 * @template T
 * @param {HTMLButtonElement} button
 * @param {{begin: () => T, done: (begun: T) => void, refused: () => void}} calls
 *   `done` gets what `begin` saw; `refused` when the button is disabled meanwhile
 */
export function onHold(button, { begin, done, refused }) {
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  /** @type {{x: number, y: number} | undefined} where the finger came down */
  let from;
  function start() {
    if (timer || button.disabled) return;
    const begun = begin();
    button.toggleAttribute("data-holding", true);
    timer = setTimeout(() => {
      end();
      done(begun);
    }, HOLD_MS);
  }
  function end() {
    clearTimeout(timer);
    timer = undefined;
    button.removeAttribute("data-holding");
  }
  button.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    from = { x: event.clientX, y: event.clientY };
    button.setPointerCapture(event.pointerId);
    start();
  });
  button.addEventListener("pointermove", ({ clientX, clientY }) => {
    if (from && Math.hypot(clientX - from.x, clientY - from.y) > SLIP_PX) end();
  });
  for (const name of ["pointerup", "pointercancel", "blur", "keyup"]) {
    button.addEventListener(name, end);
  }
  // A disabled button hears no finger go up, so its hold ends here.
  new MutationObserver(() => {
    if (!timer || !button.disabled) return;
    end();
    refused();
  }).observe(button, { attributeFilter: ["disabled"] });
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  button.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    start();
  });
}
