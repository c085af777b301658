/**
 * The Commands page: every order with the time on each transport, to study and print.
 */

import { all, make, need, needPart, setText } from "../panels/dom.js";
import { drawDue, readLast, verdictSaid } from "../panels/drill.js";
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
  const drills = createDrills(store, i18n);
  function load() {
    rows.load();
    drills.load();
  }
  store.subscribe("commands/", soon(load));
  // Goals have no topic of their own; every step of one is a line of the log.
  const loadSoon = soon(load);
  store.subscribe("log", ({ key }) => {
    if (key.startsWith("log.goal.")) loadSoon();
  });
  store.subscribe("snapshot", soon(load));
  store.subscribe("alerts", drills.draw);
  i18n.onChange(drills.draw);
  load();
}

/**
 * Each robot's last drill, for the sheet to sign.
 *
 * @param {import("../core/store.js").Store} store
 * @param {I18n} i18n
 */
function createDrills(store, i18n) {
  /** @typedef {Awaited<ReturnType<typeof readLast>>} Read */
  const lines = all("[data-drills-of]");
  /** @type {Map<HTMLElement, Read>} */
  const read = new Map();

  /** @param {HTMLElement} line */
  function drawLine(line) {
    const { last, status } = read.get(line) ?? { last: null, status: 0 };
    const missing =
      status === 200 ? i18n.t("drill.never") : i18n.t("drill.unread", { status });
    const result = last ? verdictSaid(last, i18n) : missing;
    setText(needPart("at", line), dayAndTime(last?.drilled_at ?? null));
    setText(needPart("by", line), i18n.t("rows.by", { by: last?.by ?? null }));
    setText(needPart("result", line), read.has(line) ? result : "—");
    drawDue(needPart("due", line), String(line.dataset.drillsOf), store, i18n);
  }

  const draw = () => {
    for (const line of lines) drawLine(line);
  };

  async function load() {
    await Promise.all(
      lines.map(async (line) => {
        const found = await readLast(String(line.dataset.drillsOf));
        // The table stays when the server is gone: the past stays true.
        if (found.status === 200 || !read.has(line)) read.set(line, found);
      }),
    );
    draw();
  }

  return { load, draw };
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
export function orderSaid({ kind, drill, goal }, i18n) {
  if (goal) {
    const place = i18n.t(`goal.kind.${goal.kind}`, { ...goal });
    return i18n.t("commandspage.goal", { place });
  }
  return drill ? i18n.t("drill.heading") : i18n.t(`history.kind.${kind}`);
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
