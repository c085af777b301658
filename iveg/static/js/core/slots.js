/**
 * Which hue is a robot's own, on every page: the server names it by the robot's place in
 * the fleet (`Site.slots`), and `css/tokens.css` has the hues (`--robot-1` …).
 */

export const HUES = 10;

/** @type {Map<string, number>} */
const known = new Map(Object.entries(JSON.parse(document.body.dataset.robots ?? "{}")));

/**
 * From 1; a robot that is no longer of the fleet has the next one.
 *
 * @param {string} robotId
 */
export function slotOf(robotId) {
  const slot = known.get(robotId) ?? (known.size % HUES) + 1;
  known.set(robotId, slot);
  return slot;
}

/** Whether its body and swatch have a stripe. @param {number} slot */
export const isStriped = (slot) => slot > HUES / 2;
