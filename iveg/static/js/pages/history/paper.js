/**
 * Figures on paper: whole at its width, and dark on white whatever the screen's theme.
 *
 * The library draws for the width and in the colours of the screen, and hears of a print
 * too late to draw anew.  While it prints, each drawing is a picture that can shrink.
 */

import { all } from "../../panels/dom.js";

export function fitPaper() {
  addEventListener("beforeprint", () => forPaper(true));
  addEventListener("afterprint", () => forPaper(false));
}

/** @param {boolean} isPaper */
function forPaper(isPaper) {
  const isDark = getComputedStyle(document.documentElement).colorScheme === "dark";
  for (const svg of all("svg.main-svg")) {
    svg.classList.toggle("main-svg--dark", isPaper && isDark);
    if (!isPaper) svg.removeAttribute("viewBox");
    else
      svg.setAttribute(
        "viewBox",
        `0 0 ${sizeOf(svg, "width")} ${sizeOf(svg, "height")}`,
      );
  }
}

/** As it was drawn (px). @param {HTMLElement} svg @param {"width" | "height"} side */
const sizeOf = (svg, side) => Number.parseFloat(svg.getAttribute(side) ?? "0");
