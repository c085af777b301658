/**
 * The page's rest: heavy drawing waits for it, so that STOP and the live line go first.
 */

/** A page that never rests draws nevertheless (ms). */
const LONGEST_WAIT_MS = 500;

/** Until the page has nothing else to do; what follows is a task of its own. */
export function whenResting() {
  return /** @type {Promise<void>} */ (
    new Promise((done) => {
      // Safari has no idle time to give.
      if (!("requestIdleCallback" in globalThis)) setTimeout(done, 0);
      else requestIdleCallback(() => done(), { timeout: LONGEST_WAIT_MS });
    })
  );
}
