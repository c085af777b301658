/**
 * The gestures that press a STOP control, without confirmation.
 */

/** How long after `pointerup` a click still belongs to the same gesture (ms). */
const GESTURE_MS = 400;

/**
 * One press for each gesture: finger or mouse down (not up: that is a tenth of a second
 * later), Enter, Space, or the bare click of an assistive tool.
 *
 * @param {HTMLElement} control
 * @param {() => void} press
 */
export function onPress(control, press) {
  let isGesture = false;
  control.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    isGesture = true;
    press();
  });
  for (const end of ["pointerup", "pointercancel"]) {
    addEventListener(end, () => {
      setTimeout(() => {
        isGesture = false;
      }, GESTURE_MS);
    });
  }
  control.addEventListener("click", () => {
    if (!isGesture) press();
    isGesture = false;
  });
  control.addEventListener("keydown", (event) => {
    if (!isPressKey(event)) return;
    // The browser's own click would come late (Space) or again and again (Enter).
    event.preventDefault();
    if (!event.repeat) press();
  });
  control.addEventListener("keyup", (event) => {
    if (isPressKey(event)) event.preventDefault();
  });
}

/** @param {KeyboardEvent} event */
const isPressKey = (event) =>
  (event.key === "Enter" || event.key === " ") && !event.ctrlKey && !event.altKey;

/**
 * `Ctrl+.` anywhere on the page, a field with the focus included.
 *
 * @param {() => void} press
 */
export function onFleetKeys(press) {
  const listener = (/** @type {KeyboardEvent} */ event) => {
    if (!event.ctrlKey || (event.key !== "." && event.code !== "Period")) return;
    event.preventDefault();
    event.stopPropagation();
    if (!event.repeat) press();
  };
  addEventListener("keydown", listener, { capture: true });
}
