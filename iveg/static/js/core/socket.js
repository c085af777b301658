/**
 * The browser's line to the server: opens `/live`, notices its loss, comes back.
 *
 *     connecting ──> open ──> lost ──┐
 *         │           ^   └──────────┤   probe, then a new socket
 *         │           └──────────────┘
 *         └──> signed-out                4401: the session is over, no retry
 *
 * A TCP connection can be dead for minutes before anybody is told, so silence counts as
 * loss: nothing heard for two seconds although we ping every second.  While lost, plain
 * HTTP probes look for the server and a WebSocket is opened only when one is answered,
 * because browsers delay WebSocket connections more and more after failed ones.
 */

import { createServerClock } from "./clock.js";
import { createPace, withWait } from "./pace.js";
import { createPainting } from "./painting.js";
import {
  ProtocolError,
  readFrame,
  writePainted,
  writePing,
  writeStop,
} from "./protocol.js";

/** @typedef {import("./store.js").Store} Store */
/** @typedef {import("./store.js").ConnectionState} ConnectionState */
/** @typedef {EventTarget & {readonly hidden: boolean}} PageSight what `document` tells */
/** @typedef {{robotId: string | null, pressId: string, pressedAt: number}} Press */

/** Asks for telemetry as fast as this page paints, and no faster. */
const SUBPROTOCOL = "iveg.2";
const PING_EVERY_MS = 1000;
const SILENCE_IS_LOSS_MS = 2000;
const WATCH_EVERY_MS = 250;
const RETRY_FIRST_MS = 250;
/** With the longest probe and the jitter below, recovery stays under three seconds. */
const RETRY_LAST_MS = 2000;
const PROBE_LIMIT_MS = 900;
/** A page hidden longer than this starts again from a fresh snapshot. */
const HIDDEN_LIMIT_MS = 1000;
const CLOSED_SIGNED_OUT = 4401;
/** Presses that wait for a line; more than any person makes before looking up. */
const PRESSES_KEPT = 64;

/**
 * How long to wait before the nth try (ms): doubling, with jitter downwards so that
 * fifty tablets do not all come back in the same instant.
 *
 * @param {number} tries tries that have failed, from 0
 * @param {number} luck in [0, 1)
 */
export function retryDelay(tries, luck) {
  const full = Math.min(RETRY_LAST_MS, RETRY_FIRST_MS * 2 ** tries);
  return full * (0.6 + 0.4 * luck);
}

/**
 * Connects, and stays connected until `close()`.
 *
 * @param {{
 *   url: string,
 *   store: Store,
 *   onState?: (state: ConnectionState) => void,
 *   onCommandFallback?: (press: Press) => void,
 *   probe?: () => Promise<boolean>,
 *   page?: PageSight,
 *   draws?: boolean,
 *   whenPainted?: (fn: () => void) => void,
 * }} options `draws`: this page shows telemetry, so when it paints (`whenPainted`) is worth telling;
 *   `onCommandFallback` is told of a STOP that could not be sent at once: the
 *   page tries its other transport, this one keeps the press and sends it when it can.
 */
export function connect(options) {
  const { url, store, onState, onCommandFallback, page = document } = options;
  const { draws = true, whenPainted = createPainting().when } = options;
  const isServerThere = options.probe ?? (() => probeHealth(url));
  const clock = createServerClock();
  const presses = createPresses();
  /** @type {WebSocket | null} */
  let socket = null;
  let heardAtMs = performance.now();
  let pingedAtMs = 0;
  let watchedAtMs = performance.now();
  let hiddenAtMs = 0;
  let tries = 0;
  let isFirstPong = true;
  let pace = createPace(() => {}, whenPainted);
  let malformed = 0;
  let ended = false;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let retry;

  /** @param {ConnectionState} state */
  function become(state) {
    if (state === store.connection.state) return;
    store.setConnection(state, performance.now());
    onState?.(state);
  }

  function open() {
    if (ended) return;
    drop();
    heardAtMs = performance.now();
    isFirstPong = true;
    const opened = new WebSocket(url, [SUBPROTOCOL]);
    opened.binaryType = "arraybuffer";
    pace = createPace((frame, nextMs) => {
      if (opened.readyState !== WebSocket.OPEN) return;
      const isDrawn = draws && nextMs !== null;
      const drawn = isDrawn ? clock.serverOf(performance.now()) : null;
      opened.send(writePainted(frame, drawn && withWait(drawn, nextMs ?? 0)));
    }, whenPainted);
    opened.addEventListener("open", ping);
    opened.addEventListener("message", (event) => hear(opened, event.data));
    opened.addEventListener("close", (event) => onClose(opened, event.code));
    socket = opened;
  }

  /**
   * @param {WebSocket} from
   * @param {unknown} frame
   */
  function hear(from, frame) {
    if (from !== socket) return;
    heardAtMs = performance.now();
    try {
      take(readFrame(frame));
    } catch (error) {
      if (!(error instanceof ProtocolError)) throw error;
      malformed += 1;
    }
  }

  /** @param {import("./protocol.js").Message} message */
  function take({ topic, data, at }) {
    if (topic === "pong") return takePong(/** @type {any} */ (data), at);
    if (topic === "telemetry") return takeTelemetry(/** @type {any} */ (data));
    if (topic === "snapshot") {
      tries = 0;
      become("open");
      presses.each(sendPress);
    }
    store.apply(topic, data, momentOf(at));
  }

  /** @param {import("./telemetry.js").Telemetry} telemetry */
  function takeTelemetry({ frame, told }) {
    try {
      for (const { topic, at, data } of told) store.apply(topic, data, momentOf(at));
    } finally {
      // Whatever became of it: without a word no more would ever come.
      pace.took(frame);
    }
  }

  /**
   * When what was heard just now was true (ms): the way here makes it older, and a line
   * that is full shows itself by that.
   *
   * @param {number} [at] the server's monotonic clock (s)
   */
  function momentOf(at) {
    const said = at === undefined || isFirstPong ? null : clock.localOf(at);
    return said === null ? heardAtMs : Math.min(heardAtMs, said);
  }

  /** @param {{t: number, server: number}} pong @param {number} [at] */
  function takePong({ t, server }, at) {
    if (isFirstPong) clock.reset();
    isFirstPong = false;
    clock.note(t, heardAtMs, server, at);
    presses.confirm(t);
  }

  /**
   * @param {WebSocket} from
   * @param {number} code
   */
  function onClose(from, code) {
    if (from !== socket) return;
    socket = null;
    if (code === CLOSED_SIGNED_OUT) {
      ended = true;
      become("signed-out");
    } else {
      lose();
    }
  }

  function lose() {
    drop();
    become("lost");
    clearTimeout(retry);
    retry = setTimeout(seek, retryDelay(tries, Math.random()));
    tries += 1;
  }

  async function seek() {
    const there = await isServerThere();
    if (ended || socket) return;
    if (there) open();
    else lose();
  }

  function drop() {
    const old = socket;
    socket = null;
    old?.close();
  }

  function ping() {
    if (socket?.readyState !== WebSocket.OPEN) return;
    pingedAtMs = performance.now();
    socket.send(writePing(pingedAtMs));
  }

  function watch() {
    const nowMs = performance.now();
    const wasAsleep = nowMs - watchedAtMs > 4 * WATCH_EVERY_MS;
    watchedAtMs = nowMs;
    // After a pause of this page itself, what waited in its queue is heard first.
    if (!socket || wasAsleep) return;
    if (nowMs - heardAtMs > SILENCE_IS_LOSS_MS) lose();
    else if (nowMs - pingedAtMs >= PING_EVERY_MS - WATCH_EVERY_MS / 2) ping();
  }

  function refresh() {
    if (ended) return;
    clearTimeout(retry);
    tries = 0;
    if (store.connection.state === "open") become("connecting");
    open();
  }

  function onVisibility() {
    const nowMs = performance.now();
    if (page.hidden) hiddenAtMs = nowMs;
    else if (nowMs - hiddenAtMs > HIDDEN_LIMIT_MS) refresh();
  }

  /** @param {Press} press */
  function sendPress(press) {
    if (socket?.readyState !== WebSocket.OPEN) return false;
    socket.send(writeStop(press.robotId, press.pressId, press.pressedAt));
    ping();
    presses.sent(press, pingedAtMs);
    return true;
  }

  const timer = setInterval(watch, WATCH_EVERY_MS);
  page.addEventListener("visibilitychange", onVisibility);
  addEventListener("online", refresh);
  open();

  return {
    /**
     * Sends a STOP over this line; keeps and repeats it (same `pressId`) until the line
     * proves that the server read it.  A STOP has no expiry: stopping late is safe.
     *
     * @param {string | null} robotId null = the whole fleet
     * @param {string} pressId
     * @param {number} [pressedAt] Unix time (s), offset-corrected
     * @returns {boolean} whether it went out at once
     */
    sendStop(robotId, pressId, pressedAt = clock.serverNow(performance.now())) {
      const press = { robotId, pressId, pressedAt };
      presses.add(press);
      const sent = sendPress(press);
      if (!sent) onCommandFallback?.(press);
      return sent;
    },
    state: () => store.connection.state,
    /** Unix time of the server (s). */
    serverNow: () => clock.serverNow(performance.now()),
    /** Newest round trip (ms); null before the first. */
    roundTripMs: () => clock.roundTripMs(),
    /** STOP presses that the server has not provably read. */
    pressesWaiting: () => presses.size(),
    /** Frames that could not be read. */
    malformed: () => malformed,
    close() {
      ended = true;
      clearInterval(timer);
      clearTimeout(retry);
      page.removeEventListener("visibilitychange", onVisibility);
      removeEventListener("online", refresh);
      drop();
    },
  };
}

/**
 * STOP presses that the server has not provably read.
 *
 * The server reads a line in order, so the answer to a ping that was sent after a press
 * proves that the press was read; without it the press goes out again on the next line.
 */
export function createPresses() {
  /** @type {Map<string, {press: Press, pingMs: number}>} */
  const waiting = new Map();
  return {
    /** @param {Press} press */
    add(press) {
      waiting.set(press.pressId, { press, pingMs: Number.POSITIVE_INFINITY });
      const [oldest] = waiting.keys();
      if (waiting.size > PRESSES_KEPT) waiting.delete(oldest);
    },
    /** @param {Press} press @param {number} pingMs the ping sent right after it */
    sent(press, pingMs) {
      waiting.set(press.pressId, { press, pingMs });
    },
    /** @param {number} t the ping that was answered */
    confirm(t) {
      for (const [id, { pingMs }] of waiting) if (pingMs <= t) waiting.delete(id);
    },
    /** @param {(press: Press) => unknown} fn */
    each(fn) {
      for (const { press } of [...waiting.values()]) fn(press);
    },
    size: () => waiting.size,
  };
}

/**
 * Whether anything answers HTTP where the socket will go.
 *
 * @param {string} url of the WebSocket
 * @returns {Promise<boolean>}
 */
async function probeHealth(url) {
  const health = new URL("/healthz", url);
  health.protocol = health.protocol.replace("ws", "http");
  const signal = AbortSignal.timeout(PROBE_LIMIT_MS);
  try {
    await fetch(health, { cache: "no-store", mode: "no-cors", signal });
    return true;
  } catch {
    return false;
  }
}
