/**
 * The Commands page: every order with what each of its roads took, to study and print.
 */

import { dayAndTime, millisecondsOf } from "../history/madrid.js";
import { all, make, need, needPart, setText } from "../panels/dom.js";
import { drawDue, readLast, verdictSaid } from "../panels/drill.js";
import { endSaid, summaryOf, tookOf, zeroOf } from "./latency.js";
import { createChips, createRows, soon } from "./rows.js";

/** @typedef {import("../i18n.js").Words} Words */

/** @param {import("../page.js").Page} page */
export function start({ store, words }) {
  /** @type {Set<string>} orders whose steps somebody reads */
  const opened = new Set();
  const isChosen = createChips("data-kind-chip", () => rows.draw());
  const rows = createRows({
    name: "orders",
    path: "commands",
    words,
    cells: (command) => cellsOf(command, words, opened),
    admits: ({ kind }) => isChosen(kind),
    onItems: (items) => drawSummary(items, words),
  });
  const drills = createDrills(store, words);
  function load() {
    rows.load();
    drills.load();
  }
  store.subscribe("commands/", soon(load));
  store.subscribe("snapshot", soon(load));
  store.subscribe("alerts", drills.draw);
  words.onChange(drills.draw);
  load();
}

/**
 * Each robot's last drill, for the sheet that somebody signs.
 *
 * @param {import("../store.js").Store} store
 * @param {Words} words
 */
function createDrills(store, words) {
  /** @typedef {Awaited<ReturnType<typeof readLast>>} Read */
  const lines = all("[data-drills-of]");
  /** @type {Map<HTMLElement, Read>} */
  const read = new Map();

  /** @param {HTMLElement} line */
  function drawLine(line) {
    const { last, status } = read.get(line) ?? { last: null, status: 0 };
    const missing =
      status === 200 ? words.t("drill.never") : words.t("drill.unread", { status });
    const result = last ? verdictSaid(last, words) : missing;
    setText(needPart("at", line), dayAndTime(last?.drilled_at ?? null));
    setText(needPart("by", line), last?.by ?? "—");
    setText(needPart("result", line), read.has(line) ? result : "—");
    drawDue(needPart("due", line), String(line.dataset.drillsOf), store, words);
  }

  const draw = () => {
    for (const line of lines) drawLine(line);
  };

  async function load() {
    await Promise.all(
      lines.map(async (line) => {
        const found = await readLast(String(line.dataset.drillsOf));
        // What was read stays when the server is gone: it is the past, and stays true.
        if (found.status === 200 || !read.has(line)) read.set(line, found);
      }),
    );
    draw();
  }

  return { load, draw };
}

/**
 * @param {import("./latency.js").Order} command
 * @param {Words} words
 * @param {Set<string>} opened
 */
function cellsOf(command, words, opened) {
  const took = tookOf(command);
  const number = (/** @type {number | null} */ value) =>
    make("td", "number", value === null ? "—" : words.number(value, 0));
  return [
    make("td", "time", dayAndTime(zeroOf(command.times))),
    make("td", "", command.robot_id),
    make("td", "", orderSaid(command, words)),
    endOf(command, words, opened),
    make("td", "", command.requested_by),
    number(took.accepted),
    number(took.sentDirect),
    number(took.direct),
    number(took.sentFiware),
    number(took.fiware),
    number(took.standing),
    number(command.tries),
  ];
}

/**
 * How it ended, and each step of it on demand.
 *
 * @param {import("./latency.js").Order} command
 * @param {Words} words
 * @param {Set<string>} opened
 */
function endOf(command, words, opened) {
  const cell = make("td", "what", endSaid(command, words));
  if (!command.steps?.length) return cell;
  const steps = make("details", "members");
  // The table is written anew while somebody reads it.
  steps.open = opened.has(command.command_id);
  steps.addEventListener("toggle", () => {
    if (steps.open) opened.add(command.command_id);
    else opened.delete(command.command_id);
  });
  const list = make("ol");
  for (const { at, state } of command.steps) {
    const line = make("li", "", `${millisecondsOf(at)} `);
    line.append(words.t(`history.state.${state}`));
    list.append(line);
  }
  steps.append(make("summary", "", words.t("commandspage.steps")), list);
  cell.append(steps);
  return cell;
}

/** @param {import("./latency.js").Order} command @param {Words} words */
function orderSaid({ kind, drill }, words) {
  return drill ? words.t("drill.heading") : words.t(`history.kind.${kind}`);
}

/** @param {import("./latency.js").Order[]} items @param {Words} words */
function drawSummary(items, words) {
  const { count, unconfirmed, ...roads } = summaryOf(items);
  setText(need("#took-count"), words.number(count, 0));
  setText(need("#took-unconfirmed"), words.number(unconfirmed, 0));
  for (const [road, stat] of Object.entries(roads)) {
    setText(need(`#took-${road}`), stat ? words.t("commandspage.stat", stat) : "—");
  }
}
