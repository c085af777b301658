/**
 * Presses of STOP that the server has not provably read.
 *
 * The server reads a connection in order, so the answer to a ping that was sent after a
 * press proves that the press was read; without it the press is sent again on the next
 * connection.
 *
 * @typedef {{robotId: string | null, pressId: string, pressedAt: number}} Press
 */

/** More than any person presses before looking up. */
const PRESSES_KEPT = 64;

export class UnreadPresses {
  /** @type {Map<string, {press: Press, pingMs: number}>} */
  #waiting = new Map();

  get size() {
    return this.#waiting.size;
  }

  /** @param {Press} press @param {number} [pingMs] the ping sent right after it */
  add(press, pingMs = Number.POSITIVE_INFINITY) {
    this.#waiting.set(press.pressId, { press, pingMs });
    const [oldest] = this.#waiting.keys();
    if (this.#waiting.size > PRESSES_KEPT) this.#waiting.delete(oldest);
  }

  /** @param {number} t the ping that was answered */
  confirm(t) {
    for (const [id, { pingMs }] of this.#waiting)
      if (pingMs <= t) this.#waiting.delete(id);
  }

  /** @returns {Press[]} oldest first */
  all() {
    return [...this.#waiting.values()].map(({ press }) => press);
  }
}
