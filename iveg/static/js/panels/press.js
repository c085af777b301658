/**
 * Carries a press of STOP to the server by every transport there is, until it is taken.
 *
 * HTTP first; when it fails or is silent for half a second the live line sends the same
 * press too.  All repetitions carry one `press_id`, so the server makes one STOP of
 * them.  A STOP that comes late still stops, so nothing here gives up.
 *
 * @typedef {{robotId: string | null, pressId: string, atMs: number, tries: number,
 *   accepted: boolean}} Pending `atMs` is `performance.now()` of the press
 * @typedef {{sendStop: (robotId: string | null, pressId: string, pressedAt: number)
 *   => boolean, serverNow: () => number}} Line
 */

import { TAKEN_LIMIT_MS } from "./stop_view.js";

const RETRY_MS = 1000;
const HTTP_LIMIT_MS = 3000;
/** Answers that more HTTP will not change; the line goes on trying. */
const HOPELESS = new Set([401, 403, 404]);

/**
 * @param {Line} line
 * @param {() => void} onChange
 * @param {(press: Pending, pressedAt: number) => Promise<number>} [send] HTTP; tests hand
 *   in their own
 */
export function createPresser(line, onChange, send = post) {
  /** @type {Map<string | null, Pending>} newest press by robot; null is the fleet */
  const pending = new Map();

  /** @param {Pending} press @param {number} pressedAt */
  async function carry(press, pressedAt) {
    const fallback = setTimeout(() => sendByLine(press, pressedAt), TAKEN_LIMIT_MS);
    while (isCurrent(press)) {
      press.tries += 1;
      const status = await send(press, pressedAt);
      if (status === 202 || status === 200) return accept(press, fallback);
      sendByLine(press, pressedAt);
      if (HOPELESS.has(status)) return;
      await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
    }
  }

  /** @param {Pending} press @param {number} pressedAt */
  function sendByLine(press, pressedAt) {
    if (press.accepted) return;
    line.sendStop(press.robotId, press.pressId, pressedAt);
    onChange();
  }

  /** @param {Pending} press @param {ReturnType<typeof setTimeout>} fallback */
  function accept(press, fallback) {
    clearTimeout(fallback);
    press.accepted = true;
    onChange();
  }

  /** @param {Pending} press */
  const isCurrent = (press) => !press.accepted && pending.get(press.robotId) === press;

  return {
    /** @param {string | null} robotId null = the whole fleet */
    press(robotId) {
      const atMs = performance.now();
      const press = { robotId, pressId: pressId(), atMs, tries: 0, accepted: false };
      pending.set(robotId, press);
      onChange();
      return carry(press, line.serverNow());
    },
    /** The newest press that no command has answered. @param {string | null} robotId */
    pending: (robotId) => pending.get(robotId) ?? null,
    /**
     * A command says that the server has it.
     *
     * @param {string | null} robotId
     */
    settle(robotId) {
      const press = pending.get(robotId);
      if (press) press.accepted = true;
      pending.delete(robotId);
    },
  };
}

/**
 * @param {Pending} press
 * @param {number} pressedAt Unix time (s) by the server's clock
 * @returns {Promise<number>} HTTP status; 0 where no answer came
 */
async function post(press, pressedAt) {
  const path =
    press.robotId === null
      ? "/api/v1/fleet/stop"
      : `/api/v1/robots/${encodeURIComponent(press.robotId)}/stop`;
  try {
    const answer = await fetch(path, {
      method: "POST",
      headers: { "Content-Type": "application/json", "X-IVEG": "1" },
      body: JSON.stringify({ press_id: press.pressId, pressed_at: pressedAt }),
      // The press outlives a page that is left at once.
      keepalive: true,
      signal: AbortSignal.timeout(HTTP_LIMIT_MS),
    });
    return answer.status;
  } catch {
    return 0;
  }
}

/** Random, not counted, and made without `randomUUID`, which plain HTTP lacks. */
function pressId() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return [...bytes].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}
