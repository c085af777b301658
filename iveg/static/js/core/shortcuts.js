/**
 * The map's keys: F fits, 1…9 follow a robot, 0 shows the fleet, + and − zoom, M measures,
 * ? opens the legend; while the map has the focus the arrows pan and Enter marks its
 * centre.
 *
 * Single keys can be switched off (WCAG 2.1.4), and never fire while somebody types.
 *
 * @typedef {{
 *   fit: () => void, fitFleet: () => void, robot: (n: number) => void,
 *   zoom: (steps: number) => void, pan: (x: number, y: number) => void,
 *   measure: () => void, mark: () => void, legend: () => void,
 * }} Actions
 */

/** @type {Record<string, [number, number]>} */
const ARROWS = {
  ArrowLeft: [1, 0],
  ArrowRight: [-1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

/**
 * @param {HTMLElement} element the map
 * @param {() => boolean} isEnabled
 * @param {Actions} actions
 * @returns {() => void} stops listening
 */
export function followShortcuts(element, isEnabled, actions) {
  /** @param {KeyboardEvent} event */
  function onKey(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || isTyping(event.target))
      return;
    const isHere = event.target === element;
    if (!isHere && (!isEnabled() || isInDialog(event.target))) return;
    const act = actionOf(event.key, isHere, actions);
    if (!act) return;
    event.preventDefault();
    act();
  }
  document.addEventListener("keydown", onKey);
  return () => document.removeEventListener("keydown", onKey);
}

/**
 * @param {string} key
 * @param {boolean} isHere whether the map has the focus
 * @param {Actions} actions
 * @returns {(() => void) | null}
 */
function actionOf(key, isHere, actions) {
  const { fit, fitFleet, robot, zoom, pan, measure, mark, legend } = actions;
  if (key === "f" || key === "F") return fit;
  if (key === "0") return fitFleet;
  if (/^[1-9]$/.test(key)) return () => robot(Number(key));
  if (key === "+" || key === "=") return () => zoom(1);
  if (key === "-") return () => zoom(-1);
  if (key === "m" || key === "M") return measure;
  if (key === "?") return legend;
  if (key === "Enter" && isHere) return mark;
  const arrow = isHere && ARROWS[key];
  return arrow ? () => pan(...arrow) : null;
}

/** @param {EventTarget | null} target */
function isTyping(target) {
  if (!(target instanceof HTMLElement)) return false;
  return target.isContentEditable || target.matches("input, textarea, select");
}

/** @param {EventTarget | null} target */
function isInDialog(target) {
  return target instanceof HTMLElement && target.closest("dialog") !== null;
}
