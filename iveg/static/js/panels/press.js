/**
 * Sends a press of STOP to the server by HTTP and by the live line, until it is accepted.
 *
 * HTTP first; when it fails or is silent for half a second the live line sends the same
 * press, too.  All repetitions carry one `press_id`, so the server makes one STOP of
 * them.  A late STOP still stops, so there is no last try: a press that is not accepted is
 * kept in this tab, through a reload, too, and is never sent as anything else.
 *
 * @typedef {{robotId: string | null, pressId: string, atMs: number, tries: number,
 *   accepted: boolean}} Pending `atMs` is `performance.now()` of the press
 * @typedef {{sendStop: (robotId: string | null, pressId: string, pressedAt: number)
 *   => boolean, serverNow: () => number}} Line
 */

import { TAKEN_LIMIT_MS } from "./stop_view.js";

const RETRY_MS = 1000;
const HTTP_LIMIT_MS = 3000;
/** Statuses that a repetition will not change; the live line goes on trying. */
const HOPELESS = new Set([401, 403, 404]);
const KEPT = "iveg_kept_stops";

/**
 * @param {Line} line
 * @param {() => void} onChange
 * @param {(press: Pending, pressedAt: number) => Promise<number>} [send] HTTP; tests pass
 *   their own
 * @param {Storage | null} [kept] of this tab alone
 */
export function createPresser(line, onChange, send = post, kept = tabStorage()) {
  /** @type {Map<string | null, Pending>} newest press by robot; null is the fleet */
  const pending = new Map();
  /** @type {Map<string | null, number>} when that was, by the server's clock (s) */
  const pressed = new Map();

  /** Stores the presses that are not accepted yet. */
  function keep() {
    const open = [...pending.values()].filter(({ accepted }) => !accepted);
    const rows = open.map(({ robotId, pressId, atMs }) => ({
      robotId,
      pressId,
      pressedAt: pressed.get(robotId),
      wallMs: Date.now() - (performance.now() - atMs),
    }));
    kept?.setItem(KEPT, JSON.stringify(rows));
  }

  function goOn() {
    for (const { robotId, pressId, pressedAt, wallMs } of readKept(kept)) {
      const atMs = performance.now() - Math.max(0, Date.now() - wallMs);
      begin({ robotId, pressId, atMs, tries: 0, accepted: false }, pressedAt);
    }
  }

  /** @param {Pending} press @param {number} pressedAt */
  function begin(press, pressedAt) {
    pending.set(press.robotId, press);
    pressed.set(press.robotId, pressedAt);
    keep();
    onChange();
    return carry(press, pressedAt);
  }

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
    keep();
    onChange();
  }

  /** @param {Pending} press */
  const isCurrent = (press) => !press.accepted && pending.get(press.robotId) === press;

  return {
    /** @param {string | null} robotId null = the whole fleet */
    press(robotId) {
      const atMs = performance.now();
      const press = { robotId, pressId: pressId(), atMs, tries: 0, accepted: false };
      return begin(press, line.serverNow());
    },
    /** Goes on with the presses that were kept when the page was left. */
    goOn,
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
      keep();
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

/**
 * The presses that were kept; anything else in the storage is left out.
 *
 * @param {Storage | null} kept
 * @returns {{robotId: string | null, pressId: string, pressedAt: number, wallMs: number}[]}
 */
function readKept(kept) {
  try {
    const rows = JSON.parse(kept?.getItem(KEPT) ?? "[]");
    return rows.filter(
      (/** @type {any} */ row) =>
        (row.robotId === null || typeof row.robotId === "string") &&
        typeof row.pressId === "string" &&
        Number.isFinite(row.pressedAt) &&
        Number.isFinite(row.wallMs),
    );
  } catch {
    return [];
  }
}

/** A browser may forbid it; then a press lasts as long as its page. */
function tabStorage() {
  try {
    return sessionStorage;
  } catch {
    return null;
  }
}

/** Random, not counted, and made without `randomUUID`, which plain HTTP lacks. */
function pressId() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return [...bytes].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}
