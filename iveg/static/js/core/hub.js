/**
 * Subscriptions: facts and snapshots are delivered at once, state once per frame and topic,
 * telemetry with the page's beat.
 *
 * @typedef {(data: any, topic: string) => void} Listener
 */

/** A hidden page gets no animation frames; alerts must be heard there all the same. */
const HIDDEN_FLUSH_MS = 250;

/** A fact of its own, or what later facts must not be told before. */
const AT_ONCE = /^(log|snapshot)$|^commands\//;

/**
 * @param {(flush: () => void) => void} schedule
 * @param {(flush: () => void) => void} [scheduleReadings]
 */
export function createHub(schedule, scheduleReadings = schedule) {
  /** @type {Set<{pattern: string, fn: Listener}>} */
  const listeners = new Set();
  /** @type {Set<Listener>} */
  const watchers = new Set();
  /** @type {Map<string, any>} */
  let waiting = new Map();
  /** @type {Map<string, any>} */
  let readings = new Map();

  /** @param {string} topic @param {any} data */
  function deliver(topic, data) {
    for (const { pattern, fn } of [...listeners]) {
      if (matches(pattern, topic)) guarded(fn, data, topic);
    }
  }

  function flush() {
    const told = waiting;
    waiting = new Map();
    for (const [topic, data] of told) deliver(topic, data);
  }

  function flushReadings() {
    const told = readings;
    readings = new Map();
    for (const [topic, data] of told) deliver(topic, data);
  }

  return {
    /** @param {string} pattern @param {Listener} fn */
    subscribe(pattern, fn) {
      const listener = { pattern, fn };
      listeners.add(listener);
      return () => void listeners.delete(listener);
    },
    /** @param {Listener} fn */
    watch(fn) {
      watchers.add(fn);
      return () => void watchers.delete(fn);
    },
    /** @param {string} topic @param {any} data */
    tell(topic, data) {
      for (const fn of watchers) guarded(fn, data, topic);
      if (AT_ONCE.test(topic)) {
        deliver(topic, data);
        return;
      }
      if (isReading(topic)) {
        if (!readings.size) scheduleReadings(flushReadings);
        readings.set(topic, data);
        return;
      }
      if (!waiting.size) schedule(flush);
      waiting.set(topic, data);
    },
  };
}

/**
 * One panel's error must not silence the others, the STOP control among them.
 *
 * @template {unknown[]} T
 * @param {(...values: T) => void} fn
 * @param {T} values
 */
export function guarded(fn, ...values) {
  try {
    fn(...values);
  } catch (error) {
    reportError(error);
  }
}

/**
 * Whether a pattern matches a topic: the topic itself, or one level below it.
 *
 * @param {string} pattern `people`, `robots/AGI`, `robots/`, `robots/+/scan`
 * @param {string} topic
 */
export function matches(pattern, topic) {
  if (pattern === topic) return true;
  const wanted = (pattern.endsWith("/") ? `${pattern}+` : pattern).split("/");
  if (wanted.length === 1) wanted.push("+");
  const found = topic.split("/");
  return (
    wanted.length === found.length &&
    wanted.every((word, i) => word === "+" || word === found[i])
  );
}

/** @param {string} topic */
function isReading(topic) {
  return /^(robots|detections)\/|^people$/.test(topic);
}

/**
 * @param {() => void} flush
 * @param {number} [hiddenMs] when at the latest, also where nothing is painted
 */
export function onNextFrame(flush, hiddenMs = HIDDEN_FLUSH_MS) {
  let done = false;
  const once = () => {
    if (done) return;
    done = true;
    clearTimeout(timer);
    cancelAnimationFrame(frame);
    flush();
  };
  const frame = requestAnimationFrame(once);
  const timer = setTimeout(once, hiddenMs);
}
