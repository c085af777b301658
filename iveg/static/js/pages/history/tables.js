/**
 * Rows of the history, newest first, page after page.
 *
 * @typedef {{items: any[], next: string | null}} Page
 */

import { make, need, setHidden } from "../../panels/dom.js";
import { endSaid, tookOf, zeroOf } from "../latency.js";
import { transportsOfPage } from "../rows.js";
import { dayAndTime } from "./local_time.js";

/** Worst first: a decision is as good as its worst link. */
const VERDICTS = ["missing", "late", "ok", "n/a"];

/**
 * @param {"decisions" | "commands"} name
 * @param {import("../../core/i18n.js").I18n} i18n
 * @param {(item: any, i18n: import("../../core/i18n.js").I18n) => Node[]} cells
 * @param {(cursor: string) => Promise<Page>} readMore
 */
export function createTable(name, i18n, cells, readMore) {
  const body = need(`#rows-${name} tbody`);
  const more = /** @type {HTMLButtonElement} */ (need(`#rows-${name}-more`));
  /** @type {any[]} */
  let items = [];
  /** @type {string | null} */
  let next = null;

  function draw() {
    body.replaceChildren(...items.map(row));
    setHidden(more, next === null);
    setHidden(need(`#rows-${name}-empty`), items.length > 0);
    setHidden(need(`#rows-${name}`), items.length === 0);
  }

  /** @param {any} item */
  function row(item) {
    const element = make("tr");
    element.append(...cells(item, i18n));
    return element;
  }

  more.addEventListener("click", async () => {
    if (next === null) return;
    more.disabled = true;
    try {
      const page = await readMore(next);
      items = items.concat(page.items);
      next = page.next;
      draw();
    } catch {
      // The error is on the page already; the button stays for another try.
    } finally {
      more.disabled = false;
    }
  });
  i18n.onChange(draw);

  return {
    /** @param {Page} page the newest rows; those before are forgotten */
    show(page) {
      ({ items, next } = page);
      draw();
    },
  };
}

/**
 * @param {any} item a decision of the API
 * @param {import("../../core/i18n.js").I18n} i18n
 */
export function decisionCells(item, i18n) {
  const lasted = lastedOf(item);
  const running = make("td", "rows__number", i18n.t("decision.running"));
  return [
    make("td", "", dayAndTime(item.started_at)),
    make("td", "rows__what", i18n.t(item.sentence.key, item.sentence.slots)),
    numberCell(item.distance_m, 2, i18n),
    lasted === null ? running : numberCell(lasted, 1, i18n),
    chainCell(item, i18n),
  ];
}

/**
 * @param {any} item a command of the API
 * @param {import("../../core/i18n.js").I18n} i18n
 */
export function commandCells(item, i18n) {
  const took = tookOf(item, transportsOfPage());
  return [
    make("td", "", dayAndTime(zeroOf(item.times))),
    make("td", "", item.robot_id),
    make("td", "", i18n.t(`history.kind.${item.kind}`)),
    make("td", "rows__what", endSaid(item, i18n)),
    make("td", "", i18n.t("rows.by", { by: item.requested_by })),
    ...took.answer.map((one) => numberCell(one, 0, i18n)),
    numberCell(item.standstill_ms, 0, i18n),
    numberCell(item.tries, 0, i18n),
  ];
}

/** How long a decision held (s); null while it does. @param {any} item */
export function lastedOf({ started_at, ended_at }) {
  if (ended_at === null) return null;
  return (Date.parse(ended_at) - Date.parse(started_at)) / 1000;
}

/** The worst verdict of a decision's links. @param {any} item */
export function worstOf({ links }) {
  const verdicts = links.map((/** @type {any} */ link) => link.verdict);
  return VERDICTS.find((verdict) => verdicts.includes(verdict)) ?? "n/a";
}

/** The verdict as shape and text; a press opens the whole decision. */
function chainCell(
  /** @type {any} */ item,
  /** @type {import("../../core/i18n.js").I18n} */ i18n,
) {
  const worst = worstOf(item);
  const button = make("button", "rows__open");
  button.type = "button";
  button.dataset.verdict = worst;
  button.dataset.decision = item.decision_id;
  button.append(
    make("span", "shape"),
    make("span", "", i18n.t(`decision.verdict.${worst}`)),
  );
  const cell = make("td");
  cell.append(button);
  return cell;
}

/** @param {number | null} value @param {number} decimals @param {import("../../core/i18n.js").I18n} i18n */
function numberCell(value, decimals, i18n) {
  const text = value === null ? "—" : i18n.number(value, decimals);
  return make("td", "rows__number", text);
}
