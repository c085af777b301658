/**
 * The Commands page: every order with what each of its roads took, to study and print.
 */

import { dayAndTime } from "../history/madrid.js";
import { make, need, setText } from "../panels/dom.js";
import { summaryOf, tookOf } from "./latency.js";
import { createChips, createRows, soon } from "./rows.js";

/** @typedef {import("../i18n.js").Words} Words */

/** @param {import("../page.js").Page} page */
export function start({ store, words }) {
  const isChosen = createChips("data-kind-chip", () => rows.draw());
  const rows = createRows({
    name: "orders",
    path: "commands",
    words,
    cells: (command) => cellsOf(command, words),
    admits: ({ kind }) => isChosen(kind),
    onItems: (items) => drawSummary(items, words),
  });
  store.subscribe("commands/", soon(rows.load));
  store.subscribe("snapshot", soon(rows.load));
  rows.load();
}

/** @param {import("./latency.js").Order} command @param {Words} words */
function cellsOf(command, words) {
  const took = tookOf(command);
  const number = (/** @type {number | null} */ value) =>
    make("td", "number", value === null ? "—" : words.number(value, 0));
  return [
    make("td", "time", dayAndTime(command.times.requested)),
    make("td", "", command.robot_id),
    make("td", "", words.t(`history.kind.${command.kind}`)),
    make("td", "", words.t(`history.state.${command.state}`)),
    make("td", "", command.requested_by),
    number(took.sentDirect),
    number(took.direct),
    number(took.sentFiware),
    number(took.fiware),
    number(took.standing),
    number(command.tries),
  ];
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
