/**
 * The order of a list of the API, by the heads of its columns.
 *
 * The server sorts, so that a page of rows begins with the first of all.
 */

import { all, need, setAttribute } from "../panels/dom.js";

/** @typedef {"ascending" | "descending" | "none"} Order as `aria-sort` has it */

/**
 * @param {string} name of `_rows.html`
 * @param {() => void} onChange
 * @returns {{query: () => string}} the order as a part of a query of the API
 */
export function createSorting(name, onChange) {
  const heads = all("th[aria-sort]", need(`#${name}-rows`));
  const columnOf = (/** @type {HTMLElement} */ head) =>
    String(all("[data-sort]", head)[0].dataset.sort);
  const orderOf = (/** @type {HTMLElement} */ head) =>
    /** @type {Order} */ (head.getAttribute("aria-sort"));

  for (const head of heads) {
    all("[data-sort]", head)[0].addEventListener("click", () => {
      const next = nextOrder(columnOf(head), orderOf(head));
      for (const one of heads)
        setAttribute(one, "aria-sort", one === head ? next : "none");
      onChange();
    });
  }
  return {
    query() {
      const head = heads.find((one) => orderOf(one) !== "none");
      return head ? sortQuery(columnOf(head), orderOf(head)) : "";
    },
  };
}

/** Times begin with the newest, names with the first. @param {string} column
 * @param {Order} order @returns {Order} */
export function nextOrder(column, order) {
  if (order === "none") return column === "at" ? "descending" : "ascending";
  return order === "ascending" ? "descending" : "ascending";
}

/** @param {string} column @param {Order} order */
export function sortQuery(column, order) {
  return `&sort=${order === "descending" ? "-" : ""}${column}`;
}
