/**
 * Light, dark, sunlight, and the paper's colours; kept in a cookie that the
 * server reads, so that the next page comes in the right colours at once.
 */

import { all, need } from "./dom.js";

const CHANGED = "iveg:theme";
const DARK = matchMedia("(prefers-color-scheme: dark)");

/** Wires the theme panel. */
export function createThemePanel() {
  for (const choice of /** @type {HTMLInputElement[]} */ (all("[name=theme]"))) {
    choice.addEventListener("change", () => {
      document.documentElement.dataset.theme = choice.value;
      remember("iveg_theme", choice.value);
    });
  }
  const paper = /** @type {HTMLInputElement} */ (need("#paper-colours"));
  paper.addEventListener("change", () => {
    document.documentElement.dataset.palette = paper.checked ? "paper" : "iveg";
    remember("iveg_palette", paper.checked ? "paper" : "iveg");
  });
  DARK.addEventListener("change", tell);
}

/**
 * Calls `fn` whenever colours may have changed.
 *
 * @param {() => void} fn
 */
export function onThemeChange(fn) {
  document.addEventListener(CHANGED, fn);
}

/** @param {string} name @param {string} value */
function remember(name, value) {
  // biome-ignore lint/suspicious/noDocumentCookie: cookieStore needs a secure context
  document.cookie = `${name}=${value}; Path=/; Max-Age=31536000; SameSite=Strict`;
  tell();
}

function tell() {
  document.dispatchEvent(new CustomEvent(CHANGED));
}
