/**
 * "Show this robot on the map", as an address: a link says it on any page, by finger and
 * by key, and the live page takes it out of its address once it is done.
 */

/** Where a robot is shown. @param {string} robotId */
export const addressOf = (robotId) => `/#${new URLSearchParams({ robot: robotId })}`;

/** The robot that this address asks for, once: the same link can ask again. */
export function takeAsked() {
  const robotId = new URLSearchParams(location.hash.slice(1)).get("robot");
  if (robotId !== null) history.replaceState(null, "", location.pathname);
  return robotId;
}
