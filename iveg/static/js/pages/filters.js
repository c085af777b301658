/**
 * Search in the rows of a list, and one robot of it.
 *
 * A robot is asked of the server, so that its older rows come, too; words are looked for
 * in the rows that are here.
 */

import { all, need, setAttribute } from "../panels/dom.js";

/**
 * @param {string} name of `_filters.html`
 * @param {{onRobot: () => void, onSearch: () => void}} changes
 */
export function createFilters(name, { onRobot, onSearch }) {
  const field = /** @type {HTMLInputElement} */ (need(`#${name}-search`));
  const chips = all("[data-only]", need(`#${name}-filters`));
  let robot = "";

  for (const chip of chips) {
    chip.addEventListener("click", () => {
      const pressed = String(chip.dataset.only);
      robot = robot === pressed ? "" : pressed;
      for (const one of chips)
        setAttribute(one, "aria-pressed", String(one.dataset.only === robot));
      onRobot();
    });
  }
  field.addEventListener("input", onSearch);
  return {
    /** The robot as a part of a query of the API. */
    query: () => (robot ? `&robot=${encodeURIComponent(robot)}` : ""),
    /** Whether anything is left out. */
    isOn: () => robot !== "" || field.value.trim() !== "",
    /** @param {HTMLElement} row */
    admits: (row) => hasAll(textOf(row), field.value),
  };
}

/**
 * Whether a text has every one of some words, whatever their accents and capitals.
 *
 * @param {string} text @param {string} words
 */
export function hasAll(text, words) {
  const inside = plain(text);
  return plain(words)
    .split(/\s+/)
    .every((word) => inside.includes(word));
}

/** @param {string} text */
const plain = (text) =>
  text.normalize("NFD").replace(/\p{M}/gu, "").toLowerCase().trim();

/** A row's words, cell by cell. @param {HTMLElement} row */
const textOf = (row) => [...row.children].map((cell) => cell.textContent).join(" ");
