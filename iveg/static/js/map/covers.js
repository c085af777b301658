/** Sizes of the elements over the map, so that a fitted greenhouse keeps clear of them. */

import { coverOf } from "./layers/scalebar.js";

/**
 * The elements over the map (`data-over-map` beside it, and the scale bar), each at its
 * largest since the greenhouse was fitted: counts come and go, and a greenhouse that moved
 * with them could not be watched.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {() => void} onGrowth
 */
export function createCovers(canvas, onGrowth) {
  const greenhouse = canvas.parentElement;
  /** @type {HTMLElement[]} */
  const over = [...(greenhouse?.querySelectorAll("[data-over-map]") ?? [])].map(
    asElement,
  );
  /** @type {Map<Element, import("./viewport.js").Rect>} */
  const largest = new Map();
  let height = canvas.clientHeight;

  function measure() {
    height = canvas.clientHeight;
    const { left: x, top: y } = canvas.getBoundingClientRect();
    for (const element of over) {
      const now = element.getBoundingClientRect();
      if (!now.width || !now.height) continue;
      const was = largest.get(element);
      largest.set(element, {
        left: Math.min(now.left - x, was?.left ?? Number.POSITIVE_INFINITY),
        top: Math.min(now.top - y, was?.top ?? Number.POSITIVE_INFINITY),
        right: Math.max(now.right - x, was?.right ?? 0),
        bottom: Math.max(now.bottom - y, was?.bottom ?? 0),
      });
    }
    onGrowth();
  }

  return {
    // Asked for in each frame: as measured last, for to measure now costs a layout.
    now: () => [...largest.values(), coverOf({ height })],
    forget() {
      largest.clear();
      measure();
    },
    end: onResize(over, measure),
  };
}

/** @param {Element} element */
const asElement = (element) => /** @type {HTMLElement} */ (element);

/** Reports changes of size. @param {HTMLElement[]} elements @param {() => void} fn */
export function onResize(elements, fn) {
  const observer = new ResizeObserver(fn);
  for (const element of elements) observer.observe(element);
  return () => observer.disconnect();
}
