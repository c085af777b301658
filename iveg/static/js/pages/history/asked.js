/**
 * The range and the robot that the reader has chosen, kept in the address so that a link
 * or the back button shows the same.
 *
 * @typedef {{since: number, until: number, robot: string}} Asked Unix milliseconds
 */

import { all, need, setAttribute, setHidden } from "../../panels/dom.js";
import { momentOf, typedText } from "./local_time.js";

const SPANS_MS = { "15m": 900_000, "1h": 3_600_000, "24h": 86_400_000 };
const LONGEST_MS = 31 * 86_400_000;

/**
 * @param {() => void} onChange
 */
export function createAsked(onChange) {
  const form = need("#history-asked");
  const own = need("#history-own");
  const since = /** @type {HTMLInputElement} */ (need("#history-since"));
  const until = /** @type {HTMLInputElement} */ (need("#history-until"));
  let { range, robot } = fromAddress();

  /** The range and robot as they are now; null where the range is invalid. */
  function read() {
    /** @type {Asked} */
    const asked = { ...spanOf(range), robot };
    return canBeUsed(asked) ? asked : null;
  }

  /** @param {string} name @returns {{since: number, until: number}} */
  function spanOf(name) {
    if (name in SPANS_MS) {
      const now = Date.now();
      const span = SPANS_MS[/** @type {keyof typeof SPANS_MS} */ (name)];
      return { since: now - span, until: now };
    }
    return { since: momentOf(since.value), until: momentOf(until.value) };
  }

  function show() {
    for (const chip of all("[data-range]", form)) {
      setAttribute(chip, "aria-pressed", String(chip.dataset.range === range));
    }
    for (const chip of all("[data-robot]", form)) {
      setAttribute(chip, "aria-pressed", String(chip.dataset.robot === robot));
    }
    setHidden(own, range !== "own");
  }

  function changed() {
    show();
    history.replaceState(null, "", toAddress());
    onChange();
  }

  function toAddress() {
    const query = new URLSearchParams({ range });
    if (robot) query.set("robot", robot);
    if (range === "own") {
      query.set("since", since.value);
      query.set("until", until.value);
    }
    return `?${query}`;
  }

  function fromAddress() {
    const query = new URLSearchParams(location.search);
    const named = query.get("range") ?? "15m";
    since.value = query.get("since") ?? "";
    until.value = query.get("until") ?? "";
    const robots = all("[data-robot]", form).map((chip) => chip.dataset.robot);
    const wanted = query.get("robot") ?? "";
    return {
      range: named in SPANS_MS || named === "own" ? named : "15m",
      robot: robots.includes(wanted) ? wanted : "",
    };
  }

  form.addEventListener("click", (event) => {
    const target = /** @type {Element} */ (event.target);
    const chip = /** @type {HTMLElement | null} */ (target.closest(".chip"));
    if (chip?.dataset.range) {
      // A custom range begins as the range on show.
      if (chip.dataset.range === "own" && range !== "own") fill(spanOf(range));
      range = chip.dataset.range;
      changed();
    } else if (chip) {
      robot = chip.dataset.robot ?? "";
      changed();
    }
  });
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    changed();
  });
  own.addEventListener("change", changed);

  /** @param {{since: number, until: number}} span */
  function fill(span) {
    since.value = typedText(span.since);
    until.value = typedText(span.until);
  }

  show();
  return { read };
}

/** Whether a range can be asked for. @param {{since: number, until: number}} span */
export function canBeUsed({ since, until }) {
  const length = until - since;
  return length > 0 && length <= LONGEST_MS;
}

/**
 * The same as the API's filters.
 *
 * @param {Asked} asked
 */
export function queryOf({ since, until, robot }) {
  const query = new URLSearchParams({
    since: new Date(since).toISOString(),
    until: new Date(until).toISOString(),
  });
  if (robot) query.set("robot", robot);
  return query;
}
