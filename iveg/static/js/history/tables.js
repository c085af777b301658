/**
 * Rows of the past, newest first, page after page.
 *
 * @typedef {{items: any[], next: string | null}} Page
 */

import { endSaid, tookOf, zeroOf } from "../pages/latency.js";
import { make, need, setHidden } from "../panels/dom.js";
import { dayAndTime } from "./madrid.js";

/** Worst first: a chain is as good as its worst link. */
const VERDICTS = ["missing", "late", "ok", "n/a"];

/**
 * @param {"decisions" | "commands"} name
 * @param {import("../i18n.js").Words} words
 * @param {(item: any, words: import("../i18n.js").Words) => Node[]} cells
 * @param {(cursor: string) => Promise<Page>} readMore
 */
export function createTable(name, words, cells, readMore) {
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
    element.append(...cells(item, words));
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
      // What went wrong is on the page already; the button stays to try again.
    } finally {
      more.disabled = false;
    }
  });
  words.onChange(draw);

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
 * @param {import("../i18n.js").Words} words
 */
export function decisionCells(item, words) {
  const lasted =
    item.ended_at === null
      ? null
      : (Date.parse(item.ended_at) - Date.parse(item.started_at)) / 1000;
  const running = make("td", "rows__number", words.t("decision.running"));
  return [
    make("td", "", dayAndTime(item.started_at)),
    make("td", "rows__what", words.t(item.sentence.key, item.sentence.slots)),
    numberCell(item.distance_m, 2, words),
    lasted === null ? running : numberCell(lasted, 1, words),
    chainCell(item, words),
  ];
}

/**
 * @param {any} item a command of the API
 * @param {import("../i18n.js").Words} words
 */
export function commandCells(item, words) {
  const took = tookOf(item);
  return [
    make("td", "", dayAndTime(zeroOf(item.times))),
    make("td", "", item.robot_id),
    make("td", "", words.t(`history.kind.${item.kind}`)),
    make("td", "rows__what", endSaid(item, words)),
    make("td", "", item.requested_by),
    numberCell(took.direct, 0, words),
    numberCell(took.fiware, 0, words),
    numberCell(item.standstill_ms, 0, words),
    numberCell(item.tries, 0, words),
  ];
}

/** The verdict as shape and word; pressing it opens the whole chain. */
function chainCell(
  /** @type {any} */ item,
  /** @type {import("../i18n.js").Words} */ words,
) {
  const verdicts = item.links.map((/** @type {any} */ link) => link.verdict);
  const worst = VERDICTS.find((verdict) => verdicts.includes(verdict)) ?? "n/a";
  const button = make("button", "rows__open");
  button.type = "button";
  button.dataset.verdict = worst;
  button.dataset.decision = item.decision_id;
  button.append(
    make("span", "shape"),
    make("span", "", words.t(`decision.verdict.${worst}`)),
  );
  const cell = make("td");
  cell.append(button);
  return cell;
}

/** @param {number | null} value @param {number} decimals @param {import("../i18n.js").Words} words */
function numberCell(value, decimals, words) {
  const text = value === null ? "—" : words.number(value, decimals);
  return make("td", "rows__number", text);
}
