/**
 * The Decisions page: every slow-down with its reason; its verdict leads to its own page.
 */

import { make } from "../panels/dom.js";
import { dayAndTime } from "./history/local_time.js";
import { lastedOf, worstOf } from "./history/tables.js";
import { createRows, soon } from "./rows.js";

/** @typedef {import("../core/i18n.js").I18n} I18n */

/** @param {import("../core/page.js").Page} page */
export function start({ store, i18n }) {
  const cells = (/** @type {any} */ decision) => cellsOf(decision, i18n);
  const rows = createRows({ name: "decisions", path: "decisions", i18n, cells });
  const reload = soon(rows.load);
  store.subscribe("log", ({ decision_id }) => {
    if (decision_id) reload();
  });
  store.subscribe("snapshot", reload);
  rows.load();
}

/** @param {any} decision of the API @param {I18n} i18n */
function cellsOf(decision, i18n) {
  const { started_at, robot_id, sentence, distance_m } = decision;
  const lasted = lastedOf(decision);
  const number = (
    /** @type {number | null} */ value,
    /** @type {number} */ decimals,
  ) => (value === null ? "—" : i18n.number(value, decimals));
  const end = lasted === null ? i18n.t("decision.running") : number(lasted, 1);
  return [
    make("td", "time", dayAndTime(started_at)),
    make("td", "", robot_id ?? "—"),
    make("td", "what", i18n.t(sentence.key, sentence.slots)),
    make("td", "number", number(distance_m, 2)),
    make("td", "number", end),
    chainOf(decision, i18n),
  ];
}

/** @param {any} decision @param {I18n} i18n */
function chainOf(decision, i18n) {
  const worst = worstOf(decision);
  const link = make("a", "verdict");
  link.href = `/decisions/${encodeURIComponent(decision.decision_id)}`;
  link.dataset.verdict = worst;
  link.append(
    make("span", "shape"),
    make("span", "", i18n.t(`decision.verdict.${worst}`)),
  );
  const cell = make("td", "named");
  cell.append(link);
  return cell;
}
