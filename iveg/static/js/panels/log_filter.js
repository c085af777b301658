/**
 * The filter of the log.
 *
 * Within one kind of chip any may match, across kinds all must; no chip pressed shows
 * everything.  The chosen chips are remembered, and always visible: a hidden filter would
 * hide new entries.
 *
 * @typedef {import("../core/protocol.js").Entry} Entry
 * @typedef {"kind" | "robot" | "class" | "rule" | "priority"} Group
 * @typedef {ReturnType<typeof createChosen>} Chosen
 */

import { browserStorage } from "../map/layers/memory.js";
import { make, setAttribute } from "./dom.js";

const KEY = "iveg.log";
/** The groups of chips; those of the robots are learnt. */
const NAMES = /** @type {const} */ ({
  kind: ["detection", "speed", "command", "link", "alert", "system"],
  robot: [],
  class: ["person", "robot"],
  rule: ["person", "robot", "stale", "doubt", "unsupervised", "watchdog", "obstacle"],
  priority: ["P1", "P2", "P3"],
});
const GROUPS = /** @type {Group[]} */ (Object.keys(NAMES));
/** Chips that are visible at once; the others after a press. */
const FIRST = new Set(["kind", "robot"]);

/**
 * The chips that an entry matches, by group; null where a group does not apply.
 *
 * @param {Entry} entry
 * @returns {Record<Group, string | null>}
 */
export function facetsOf(entry) {
  const { reason, priority } = entry.slots;
  const isSlowDown = entry.key.startsWith("log.speed_down");
  return {
    kind: entry.kind,
    robot: entry.robot_id,
    class: entry.class,
    rule: isSlowDown && typeof reason === "string" ? reason : null,
    priority: typeof priority === "string" ? priority : null,
  };
}

/** @param {Storage | null} storage null where the browser keeps nothing */
export function createChosen(storage = browserStorage()) {
  const pressed = read(storage);

  return {
    /** @param {Group} group @param {string} name */
    has: (group, name) => pressed[group].has(name),
    /** @param {Group} group @param {string} name */
    toggle(group, name) {
      if (!pressed[group].delete(name)) pressed[group].add(name);
      write(storage, pressed);
    },
    clear() {
      for (const group of GROUPS) pressed[group].clear();
      write(storage, pressed);
    },
    /** Everything that is pressed, in the order of the chips. */
    all: () =>
      GROUPS.flatMap((group) => [...pressed[group]].map((name) => ({ group, name }))),
    /** @param {Entry} entry */
    admits(entry) {
      const facets = facetsOf(entry);
      return GROUPS.every((group) => {
        const value = facets[group];
        return !pressed[group].size || (value !== null && pressed[group].has(value));
      });
    },
  };
}

/** @param {Storage | null} storage @returns {Record<Group, Set<string>>} */
function read(storage) {
  const kept = parse(storage?.getItem(KEY));
  const names = (/** @type {Group} */ group) =>
    Array.isArray(kept?.[group]) ? kept[group].map(String) : [];
  return /** @type {Record<Group, Set<string>>} */ (
    Object.fromEntries(GROUPS.map((group) => [group, new Set(names(group))]))
  );
}

/** @param {string | null | undefined} text @returns {any} */
function parse(text) {
  try {
    return JSON.parse(text ?? "{}");
  } catch {
    return {};
  }
}

/** @param {Storage | null} storage @param {Record<Group, Set<string>>} pressed */
function write(storage, pressed) {
  const kept = Object.fromEntries(GROUPS.map((group) => [group, [...pressed[group]]]));
  try {
    storage?.setItem(KEY, JSON.stringify(kept));
  } catch {
    // A full or forbidden storage costs the memory of a filter, never the filter.
  }
}

/**
 * The chips of all groups.
 *
 * @param {{place: HTMLElement, i18n: import("../core/i18n.js").I18n, chosen: Chosen,
 *   robots: () => Iterable<string>, onChange: () => void}} options
 */
export function createLogChips({ place, i18n, chosen, robots, onChange }) {
  let isOpen = false;

  /** @param {Group} group @param {string} name */
  function nameOf(group, name) {
    if (group === "robot") return name;
    return i18n.t(group === "class" ? `class.${name}` : `logpanel.${group}.${name}`);
  }

  /** @param {Group} group @param {string} name */
  function makeChip(group, name) {
    const chip = make("button", "chip", nameOf(group, name));
    chip.type = "button";
    chip.dataset.filter = `${group}:${name}`;
    chip.hidden = !isOpen && !FIRST.has(group) && !chosen.has(group, name);
    setAttribute(chip, "aria-pressed", String(chosen.has(group, name)));
    chip.addEventListener("click", () => {
      chosen.toggle(group, name);
      setAttribute(chip, "aria-pressed", String(chosen.has(group, name)));
      onChange();
    });
    return chip;
  }

  function makeMore() {
    const more = make("button", "chip chip--more");
    more.type = "button";
    more.textContent = i18n.t(isOpen ? "logpanel.fewer" : "logpanel.more");
    setAttribute(more, "aria-expanded", String(isOpen));
    more.addEventListener("click", () => {
      isOpen = !isOpen;
      draw();
      /** @type {HTMLElement | null} */ (place.querySelector(".chip--more"))?.focus();
    });
    return more;
  }

  function draw() {
    const chips = GROUPS.flatMap((group) => {
      // A robot that has gone keeps its chip while it is pressed.
      const pressed = chosen.all().filter((one) => one.group === group);
      const known = group === "robot" ? robots() : NAMES[group];
      const names = new Set([...known, ...pressed.map(({ name }) => name)]);
      return [...names].map((name) => makeChip(group, name));
    });
    place.replaceChildren(...chips, makeMore());
  }

  draw();
  return {
    draw,
    /** The pressed chips as a text. */
    said: () => chosen.all().map(({ group, name }) => nameOf(group, name)),
  };
}
