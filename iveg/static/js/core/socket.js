/**
 * The page's line to the server: opens `/live`, notices its loss, comes back.
 *
 *     connecting ──> open ──> lost ──┐
 *         │           ^   └──────────┤   probe, then a new socket
 *         │           └──────────────┘
 *         └──> signed-out                4401: the session is over, no retry
 *
 * A TCP connection can be dead for minutes before the browser learns of it, so silence
 * counts as loss: no message for two seconds although a ping goes out every second.
 * While lost, plain HTTP probes look for the server and a WebSocket is opened only when
 * one is answered, because browsers delay WebSocket connections more and more after
 * failed ones.
 */

import { createServerClock } from "./clock.js";
import { LiveSocket } from "./live_socket.js";
import { createPainting } from "./painting.js";
import { UnreadPresses } from "./presses.js";

/** @typedef {import("./store.js").Store} Store */
/** @typedef {import("./presses.js").Press} Press */
/** @typedef {EventTarget & {readonly hidden: boolean}} Visibility what `document` tells */

const PING_EVERY_MS = 1000;
const SILENCE_IS_LOSS_MS = 2000;
const WATCH_EVERY_MS = 250;
/** A slow server is one all the same: what is too late for an open line is too late here. */
const PROBE_LIMIT_MS = SILENCE_IS_LOSS_MS;
/** A probe was answered, so a new line gets more time than one that fell silent. */
const OPENING_LIMIT_MS = 5000;
const RETRY_FIRST_MS = 250;
/** With the longest probe, recovery stays under three seconds. */
const RETRY_LAST_MS = 900;
/** A page hidden longer than this starts again from a fresh snapshot. */
const HIDDEN_LIMIT_MS = 1000;
const CLOSED_SIGNED_OUT = 4401;

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

/** Connects, and stays connected until the session is over. */
export class LiveLine {
  #url;
  #store;
  #page;
  #painting;
  #clock = createServerClock();
  #presses = new UnreadPresses();
  /** @type {LiveSocket | null} */
  #socket = null;
  #tries = 0;
  #isOver = false;
  #watchedAtMs = performance.now();
  #hiddenAtMs = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #retry;

  /**
   * @param {{
   *   url: string,
   *   store: Store,
   *   page?: Visibility,
   *   draws?: boolean,
   *   whenPainted?: import("./live_socket.js").Painting["whenPainted"],
   * }} options `draws` and `whenPainted` as for `LiveSocket`
   */
  constructor(options) {
    const { url, store, page = document } = options;
    const { draws = true, whenPainted = createPainting().when } = options;
    this.#url = url;
    this.#store = store;
    this.#page = page;
    this.#painting = { draws, whenPainted };
    setInterval(() => this.#watch(), WATCH_EVERY_MS);
    page.addEventListener("visibilitychange", () => this.#onVisibility());
    addEventListener("online", () => this.#refresh());
    this.#open();
  }

  /**
   * Sends a STOP over this line; keeps and repeats it (same `pressId`) until the server
   * has provably read it.  A STOP has no expiry: stopping late is safe.
   *
   * @param {string | null} robotId null = the whole fleet
   * @param {string} pressId
   * @param {number} [pressedAt] Unix time (s), offset-corrected
   * @returns {boolean} whether it went out at once
   */
  sendStop(robotId, pressId, pressedAt = this.serverNow()) {
    const press = { robotId, pressId, pressedAt };
    this.#presses.add(press);
    return this.#sendPress(press);
  }

  /** Unix time of the server (s). */
  serverNow() {
    return this.#clock.serverNow(performance.now());
  }

  /** Newest round trip (ms); null before the first. */
  roundTripMs() {
    return this.#clock.roundTripMs();
  }

  /** How many presses of STOP the server has not provably read. */
  pressesWaiting() {
    return this.#presses.size;
  }

  #open() {
    this.#drop();
    this.#socket = new LiveSocket(
      this.#url,
      this.#clock,
      this.#receiver,
      this.#painting,
    );
  }

  /** @type {import("./live_socket.js").Receiver} */
  #receiver = {
    apply: (topic, data, receivedAtMs) => {
      if (topic === "snapshot") this.#opened();
      this.#store.apply(topic, data, receivedAtMs);
    },
    confirm: (pingMs) => this.#presses.confirm(pingMs),
    closed: (code) => {
      this.#socket = null;
      if (code !== CLOSED_SIGNED_OUT) return this.#lose();
      this.#isOver = true;
      this.#store.setConnection("signed-out", performance.now());
    },
  };

  #opened() {
    this.#tries = 0;
    this.#store.setConnection("open", performance.now());
    for (const press of this.#presses.all()) this.#sendPress(press);
  }

  /** @param {Press} press */
  #sendPress(press) {
    if (!this.#socket?.isOpen) return false;
    this.#socket.sendStop(press);
    this.#presses.add(press, this.#socket.pingedAtMs);
    return true;
  }

  #lose() {
    this.#drop();
    this.#store.setConnection("lost", performance.now());
    clearTimeout(this.#retry);
    const delayMs = retryDelay(this.#tries, Math.random());
    this.#retry = setTimeout(() => this.#seek(), delayMs);
    this.#tries += 1;
  }

  async #seek() {
    const isThere = await probeHealth(this.#url);
    if (this.#isOver || this.#socket) return;
    if (isThere) this.#open();
    else this.#lose();
  }

  #drop() {
    this.#socket?.drop();
    this.#socket = null;
  }

  #watch() {
    const nowMs = performance.now();
    const wasAsleep = nowMs - this.#watchedAtMs > 4 * WATCH_EVERY_MS;
    this.#watchedAtMs = nowMs;
    // After a pause of this page itself, the messages in its queue are read first.
    if (!this.#socket || wasAsleep) return;
    const { heardAtMs, pingedAtMs, hasHeard } = this.#socket;
    const silentMs = nowMs - heardAtMs;
    if (silentMs > (hasHeard ? SILENCE_IS_LOSS_MS : OPENING_LIMIT_MS)) this.#lose();
    else if (silentMs > SILENCE_IS_LOSS_MS) this.#store.setConnection("lost", nowMs);
    else if (nowMs - pingedAtMs >= PING_EVERY_MS - WATCH_EVERY_MS / 2)
      this.#socket.ping();
  }

  #refresh() {
    if (this.#isOver) return;
    clearTimeout(this.#retry);
    this.#tries = 0;
    if (this.#store.connection.state === "open")
      this.#store.setConnection("connecting", performance.now());
    this.#open();
  }

  #onVisibility() {
    const nowMs = performance.now();
    if (this.#page.hidden) this.#hiddenAtMs = nowMs;
    else if (nowMs - this.#hiddenAtMs > HIDDEN_LIMIT_MS) this.#refresh();
  }
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
