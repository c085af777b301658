/**
 * The full-width lines for a STOP that must not be overlooked, one for each robot.
 *
 * Each says what to do and where the robot is before who pressed, how often it was sent, and
 * how far the robot may have driven since.
 */

import { ageOf } from "../core/clock.js";
import { fill, make, need, setText } from "./dom.js";
import { doubtOf, since, stateOfCommand } from "./stop_view.js";

/** @typedef {import("../core/protocol.js").Command} Command */

const LOUD = new Set(["unconfirmed", "still_moving", "moved"]);

/** @param {import("../main.js").App} app */
export function createLoudLines({ store, i18n, line }) {
  /**
   * @param {(Command | undefined)[]} commands the newest STOP of each robot
   * @param {import("./press.js").Pending[]} kept presses that wait for the link
   */
  function draw(commands, kept) {
    const loud = commands.filter((command) =>
      LOUD.has(stateOfCommand(command ?? null) ?? ""),
    );
    const said = [
      ...kept.map(keptSaid),
      ...loud.map((command) => sentenceOf(/** @type {Command} */ (command))),
    ];
    fill(need("#p1"), said, () => make("p", "p1__line"), setText);
  }

  /** @param {import("./press.js").Pending} press */
  function keptSaid({ robotId, atMs }) {
    const robot = robotId ?? i18n.t("stop.fleet_name");
    const seconds = (performance.now() - atMs) / 1000;
    const place = robotId === null ? " " : placeSaid(robotId);
    return i18n.t("stop.p1.kept", { robot, seconds, place });
  }

  /** Where it was heard last. @param {string} robotId */
  function placeSaid(robotId) {
    const robot = store.robots().get(robotId);
    const age = ageOf(robot);
    if (!robot?.pose || !Number.isFinite(age)) return i18n.t("stop.p1.nowhere");
    const slots = { ...robot.pose, lane: robot.lane, age };
    return i18n.t(robot.lane === null ? "stop.p1.at" : "stop.p1.in", slots);
  }

  /** @param {Command} command */
  function sentenceOf(command) {
    const { robot, transports, times } = command;
    const doubt = doubtOf(command, performance.now());
    const state = String(stateOfCommand(command));
    return i18n.t(`stop.p1.${state}`, {
      robot: command.robot_id,
      place: placeSaid(command.robot_id),
      seconds: since(times.pressed ?? times.requested, line.serverNow()),
      who: command.requesters.join(", "),
      tries: command.tries,
      report: doubt
        ? i18n.t("stop.p1.report", { age: doubt.ageS, speed: robot?.v ?? 0 })
        : i18n.t("stop.p1.no_report"),
      moved: doubt ? i18n.t("stop.p1.could", { distance: doubt.movedM }) : " ",
      transports: i18n.t("stop.p1.transports", {
        said: transportsSaid(transports ?? {}, i18n),
      }),
    });
  }

  return { draw };
}

/**
 * Every transport of the server's table, with the state of the order on it.
 *
 * @param {Record<string, string>} transports by id
 * @param {{t: (key: string) => string}} i18n
 */
export function transportsSaid(transports, i18n) {
  return Object.entries(transports)
    .map(([id, state]) => {
      const name = id === "direct" ? i18n.t("stop.transport_direct") : id.toUpperCase();
      return `${name} ${i18n.t(`stop.transport.${state}`)}`;
    })
    .join(", ");
}
