/**
 * A list of the API as a table that says when it is loading, empty or unreachable.
 *
 * @typedef {{items: any[], next: string | null}} Listing
 */

import { readApi } from "../core/api.js";
import { make, need, setHidden, setText } from "../panels/dom.js";
import { createFilters } from "./filters.js";

const ROWS = 50;

/**
 * @param {{name: string, path: string, i18n: import("../core/i18n.js").I18n,
 *   cells: (item: any) => Node[], admits?: (item: any) => boolean,
 *   belongs?: (item: any) => boolean, onItems?: (items: any[]) => void}} options
 *   `name` of `_rows.html`; `path` below `/api/v1/`; `belongs`: whatever the filters
 */
export function createRows(options) {
  const { name, path, i18n, cells, onItems } = options;
  const { admits = () => true, belongs = () => true } = options;
  const body = need(`#${name}-rows tbody`);
  const more = /** @type {HTMLButtonElement} */ (need(`#${name}-more`));
  /** @type {any[]} */
  let items = [];
  /** @type {string | null} */
  let next = null;
  let status = 200;
  let isLoaded = false;
  const filters = createFilters(name, { onRobot: load, onSearch: draw });

  function draw() {
    const own = items.filter(belongs);
    const shown = own.filter(admits).map(makeRow).filter(filters.admits);
    body.replaceChildren(...shown);
    const failed = need(`#${name}-error`);
    setHidden(failed, status === 200);
    setText(failed, i18n.t(status ? "rows.failed" : "rows.offline", { status }));
    setHidden(need(`#${name}-loading`), isLoaded);
    setHidden(need(`#${name}-scroll`), shown.length === 0);
    const empty = need(`#${name}-empty`);
    setHidden(empty, !isLoaded || shown.length > 0 || status !== 200);
    const isFiltered = own.length > 0 || filters.isOn();
    const why = isFiltered ? "logpanel.empty_filter" : `rows.empty.${name}`;
    setText(empty, i18n.t(why));
    setHidden(more, next === null);
    onItems?.(items);
  }

  /** @param {any} item */
  function makeRow(item) {
    const row = make("tr");
    row.append(...cells(item));
    return row;
  }

  /** Null also where other rows have been asked for since. @param {string} query */
  async function read(query) {
    const asked = filters.query();
    const answer = await readApi(`${path}?limit=${ROWS}${asked}${query}`);
    if (asked !== filters.query()) return null;
    status = answer.status;
    isLoaded = true;
    return /** @type {Listing | null} */ (status === 200 ? answer.body : null);
  }

  async function load() {
    const page = await read("");
    // The rows stay when the server is gone: the past stays true.
    if (page) ({ items, next } = page);
    draw();
  }

  async function loadMore() {
    if (next === null) return;
    more.disabled = true;
    const page = await read(`&cursor=${encodeURIComponent(next)}`);
    if (page) {
      items = items.concat(page.items);
      next = page.next;
    }
    more.disabled = false;
    draw();
  }

  more.addEventListener("click", loadMore);
  i18n.onChange(draw);
  return { load, draw };
}

/**
 * Calls `fn` a while after an event, and once for all events in between: the history is
 * written in batches, so an event is in it a moment later.  Endless events do not defer
 * the call.
 *
 * @param {() => void} fn
 * @param {number} [afterMs]
 */
export function soon(fn, afterMs = 1200) {
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  let isAsked = false;
  function begin() {
    isAsked = false;
    timer = setTimeout(() => {
      timer = undefined;
      fn();
      if (isAsked) begin();
    }, afterMs);
  }
  return () => {
    if (timer === undefined) begin();
    else isAsked = true;
  };
}

/**
 * Chips of which any number may be pressed; none pressed admits everything.
 *
 * @param {string} attribute `data-…` that names what a chip admits
 * @param {() => void} onChange
 * @returns {(value: string) => boolean}
 */
export function createChips(attribute, onChange) {
  /** @type {Set<string>} */
  const pressed = new Set();
  for (const chip of document.querySelectorAll(`[${attribute}]`)) {
    const value = String(chip.getAttribute(attribute));
    chip.addEventListener("click", () => {
      if (!pressed.delete(value)) pressed.add(value);
      chip.setAttribute("aria-pressed", String(pressed.has(value)));
      onChange();
    });
  }
  return (value) => pressed.size === 0 || pressed.has(value);
}

/**
 * Keeps details open, or closed, while their table is rewritten under a person who reads.
 *
 * @param {HTMLDetailsElement} details
 * @param {Set<string>} opened what is open
 * @param {string} id
 */
export function keepOpen(details, opened, id) {
  details.open = opened.has(id);
  details.addEventListener("toggle", () => {
    if (details.open) opened.add(id);
    else opened.delete(id);
  });
}

/** The transports that a page has columns for. */
export function transportsOfPage() {
  const page = /** @type {HTMLElement} */ (document.querySelector("[data-transports]"));
  return String(page.dataset.transports).split(" ");
}
