/**
 * Tables as cards on a phone: each cell carries the head of its column, which the style
 * sheet writes before it where there is no room for columns, and which cells say nothing.
 */

import { all } from "./dom.js";

/** @param {import("../main.js").App} app */
export function labelTables({ i18n }) {
  const tables = all("table");
  const label = () => {
    for (const table of tables) labelCells(table);
  };
  for (const table of tables) {
    const observer = new MutationObserver(() => labelCells(table));
    observer.observe(table, { childList: true, characterData: true, subtree: true });
  }
  i18n.onChange(label);
  label();
}

/** @param {HTMLElement} table with one row of heads */
export function labelCells(table) {
  const heads = all("thead th", table).map(({ textContent }) => textContent ?? "");
  for (const row of all("tbody tr", table)) {
    for (const [i, cell] of [...row.children].entries()) {
      const name = heads[i] ?? "";
      const has = cell.getAttribute("data-head");
      if (has !== name) cell.setAttribute("data-head", name);
      cell.toggleAttribute("data-none", cell.textContent === "—");
    }
  }
}
