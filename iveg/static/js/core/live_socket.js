/**
 * One WebSocket to `/live`, from its opening to its end: pings, the age of what arrives,
 * and the report to the server of painted frames.
 *
 * @typedef {import("./presses.js").Press} Press
 * @typedef {import("./clock.js").ServerClock} ServerClock
 * @typedef {{draws: boolean, whenPainted: (fn: () => void) => void}} Painting `draws`:
 *   this page shows telemetry, so the moment when it paints is worth telling
 * @typedef {{
 *   apply: (topic: string, data: any, receivedAtMs: number) => void,
 *   confirm: (pingMs: number) => void,
 *   closed: (code: number) => void,
 * }} Receiver `confirm`: everything sent before that ping was read
 */

import { createPace } from "./pace.js";
import { readFrame, writePainted, writePing, writeStop } from "./protocol.js";

/** Asks for telemetry as fast as this page paints, and no faster. */
const SUBPROTOCOL = "iveg.2";

export class LiveSocket {
  #socket;
  #clock;
  #receiver;
  #draws;
  #pace;
  #isTimed = false;
  #isDropped = false;
  hasHeard = false;
  heardAtMs = performance.now();
  pingedAtMs = 0;

  /**
   * @param {string} url
   * @param {ServerClock} clock
   * @param {Receiver} receiver
   * @param {Painting} painting
   */
  constructor(url, clock, receiver, { draws, whenPainted }) {
    this.#clock = clock;
    this.#receiver = receiver;
    this.#draws = draws;
    this.#pace = createPace(
      (frame, isDrawn) => this.#painted(frame, isDrawn),
      whenPainted,
    );
    this.#socket = new WebSocket(url, [SUBPROTOCOL]);
    this.#socket.binaryType = "arraybuffer";
    this.#socket.addEventListener("open", () => this.ping());
    this.#socket.addEventListener("message", ({ data }) => this.#hear(data));
    this.#socket.addEventListener("close", ({ code }) => this.#close(code));
  }

  get isOpen() {
    return this.#socket.readyState === WebSocket.OPEN;
  }

  ping() {
    if (!this.isOpen) return;
    this.pingedAtMs = performance.now();
    this.#socket.send(writePing(this.pingedAtMs));
  }

  /** The press, and the ping whose answer proves that it was read.
   * @param {Press} press */
  sendStop({ robotId, pressId, pressedAt }) {
    this.#socket.send(writeStop(robotId, pressId, pressedAt));
    this.ping();
  }

  /** Closes it; the receiver hears no more of it, nor of its end. */
  drop() {
    this.#isDropped = true;
    this.#socket.close();
  }

  /** @param {number} code */
  #close(code) {
    if (!this.#isDropped) this.#receiver.closed(code);
  }

  /**
   * A frame that cannot be read throws: the browser reports it, the connection goes on.
   *
   * @param {unknown} frame
   */
  #hear(frame) {
    if (this.#isDropped) return;
    this.hasHeard = true;
    this.heardAtMs = performance.now();
    const { topic, data, at } = readFrame(frame);
    if (topic === "pong") this.#takePong(/** @type {any} */ (data), at);
    else if (topic === "telemetry") this.#takeTelemetry(/** @type {any} */ (data));
    else this.#receiver.apply(topic, data, this.#momentOf(at));
  }

  /** @param {import("./telemetry.js").Telemetry} telemetry */
  #takeTelemetry({ frame, told }) {
    try {
      for (const { topic, at, data } of told)
        this.#receiver.apply(topic, data, this.#momentOf(at));
    } finally {
      // Whatever became of it: without this answer the server sends no more frames.
      this.#pace.took(frame);
    }
  }

  /** @param {{t: number, server: number}} pong @param {number} [at] */
  #takePong({ t, server }, at) {
    if (!this.#isTimed) this.#clock.reset();
    this.#isTimed = true;
    this.#clock.note(t, this.heardAtMs, server, at);
    this.#receiver.confirm(t);
  }

  /**
   * When a message that just arrived was true (ms): its way here makes it older, and a
   * congested connection shows itself by that.
   *
   * @param {number} [at] the server's monotonic clock (s)
   */
  #momentOf(at) {
    const told = at === undefined || !this.#isTimed ? null : this.#clock.localOf(at);
    return told === null ? this.heardAtMs : Math.min(this.heardAtMs, told);
  }

  /** @param {number} frame @param {boolean} isDrawn */
  #painted(frame, isDrawn) {
    if (!this.isOpen) return;
    const isTimed = this.#draws && isDrawn;
    const drawn = isTimed ? this.#clock.serverOf(performance.now()) : null;
    this.#socket.send(writePainted(frame, drawn));
  }
}
