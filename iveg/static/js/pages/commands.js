/**
 * The Commands page: every order with the time on each transport, to study and print.
 */

import { make, need, setText } from "../panels/dom.js";
import { dayAndTime, millisecondsOf } from "./history/local_time.js";
import { endSaid, summaryOf, tookOf, zeroOf } from "./latency.js";
import { createChips, createRows, keepOpen, soon, transportsOfPage } from "./rows.js";

/** @typedef {import("../core/i18n.js").I18n} I18n */

/** @param {import("../core/page.js").Page} page */
export function start({ store, i18n }) {
  /** @type {Set<string>} orders whose steps somebody reads */
  const opened = new Set();
  const transports = transportsOfPage();
  const isChosen = createChips("data-kind-chip", () => rows.draw());
  const rows = createRows({
    name: "orders",
    path: "commands",
    i18n,
    cells: (command) => cellsOf(command, transports, i18n, opened),
    admits: ({ kind }) => isChosen(kind),
    onItems: (items) => drawSummary(items, transports, i18n),
  });
  const loadSoon = soon(() => rows.load());
  store.subscribe("commands/", loadSoon);
  // Goals have no topic of their own; every step of one is a line of the log.
  store.subscribe("log", ({ key }) => {
    if (key.startsWith("log.goal.")) loadSoon();
  });
  store.subscribe("snapshot", loadSoon);
  rows.load();
}

/**
 * @param {import("./latency.js").Order} command
 * @param {readonly string[]} transports
 * @param {I18n} i18n
 * @param {Set<string>} opened
 */
function cellsOf(command, transports, i18n, opened) {
  const took = tookOf(command, transports);
  const number = (/** @type {number | null} */ value, kind = "number") =>
    make("td", kind, value === null ? "—" : i18n.number(value, 0));
  const extra = (/** @type {number | null} */ value) => number(value, "number extra");
  return [
    make("td", "time", dayAndTime(zeroOf(command.times))),
    make("td", "", command.robot_id),
    orderOf(command, i18n),
    endOf(command, i18n, opened),
    make("td", "", i18n.t("rows.by", { by: command.requested_by })),
    extra(took.accepted),
    ...transports.flatMap((_, i) => [extra(took.sent[i]), number(took.answer[i])]),
    number(took.standing),
    number(command.tries),
  ];
}

/** What was asked, which leads to its page. @param {import("./latency.js").Order} command
 * @param {I18n} i18n */
function orderOf(command, i18n) {
  const link = make("a", "verdict", orderSaid(command, i18n));
  link.href = `/commands/${encodeURIComponent(command.command_id)}`;
  const cell = make("td");
  cell.append(link);
  return cell;
}

/**
 * How it ended, and each step of it on demand.
 *
 * @param {import("./latency.js").Order} command
 * @param {I18n} i18n
 * @param {Set<string>} opened
 */
function endOf(command, i18n, opened) {
  const cell = make("td", "what", endSaid(command, i18n));
  cell.append(...makeSteps(command, i18n, opened));
  return cell;
}

/**
 * The audit trail, to unfold; nothing where there is none.
 *
 * @param {import("./latency.js").Order} command
 * @param {I18n} i18n
 * @param {Set<string>} opened orders whose steps somebody reads
 */
export function makeSteps(command, i18n, opened) {
  if (!command.steps?.length) return [];
  const steps = make("details", "members");
  keepOpen(steps, opened, command.command_id);
  const list = make("ol");
  for (const { at, state } of command.steps) {
    const line = make("li", "", `${millisecondsOf(at)} `);
    line.append(i18n.t(`history.state.${state}`));
    list.append(line);
  }
  steps.append(make("summary", "", i18n.t("commandspage.steps")), list);
  return [steps];
}

/** @param {import("./latency.js").Order} command @param {I18n} i18n */
export function orderSaid({ kind, goal }, i18n) {
  if (goal) {
    const place = i18n.t(`goal.kind.${goal.kind}`, { ...goal });
    return i18n.t("commandspage.goal", { place });
  }
  return i18n.t(`history.kind.${kind}`);
}

/**
 * @param {import("./latency.js").Order[]} items
 * @param {readonly string[]} transports
 * @param {I18n} i18n
 */
function drawSummary(items, transports, i18n) {
  const { count, unconfirmed, answer, standing } = summaryOf(items, transports);
  setText(need("#took-count"), i18n.number(count, 0));
  setText(need("#took-unconfirmed"), i18n.number(unconfirmed, 0));
  const stats = [...answer, standing];
  for (const [i, name] of [...transports, "standing"].entries()) {
    const stat = stats[i];
    setText(need(`#took-${name}`), stat ? i18n.t("commandspage.stat", stat) : "—");
  }
}
