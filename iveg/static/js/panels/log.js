/**
 * The action and inference log: newest first, every entry a plain sentence.
 *
 * Chips narrow it down: within one kind of chip any may match, across kinds all must;
 * no chip pressed shows everything.
 */

import { make, need, setAttribute, setHidden, setText } from "./dom.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../protocol.js").Entry} Entry */

/** Entries in the list; the store keeps more, history keeps all. */
const SHOWN = 200;
const KINDS = ["detection", "speed", "command", "link", "alert", "system"];
const CLASSES = ["person", "robot"];

/**
 * @param {App} app
 * @param {{open: (decisionId: string, opener: HTMLElement) => void}} decision
 */
export function createLogPanel(app, decision) {
  const { store, words } = app;
  const list = need("#log");
  const empty = need("#log-empty");
  const filter = createFilter(app, rebuild);

  /** @param {Entry} entry */
  function makeItem(entry) {
    const item = make("li");
    item.dataset.kind = entry.kind;
    item.dataset.id = String(entry.id);
    if (entry.robot_id) item.dataset.robot = entry.robot_id;
    const text = make("p");
    const time = make("time", "", words.time(entry.at));
    time.dateTime = entry.at;
    const place = entry.decision_id ? makeOpener(entry) : text;
    place.append(time, " ", words.t(keyOf(entry), entry.slots));
    if (place !== text) text.append(place);
    item.append(make("span", "log__mark"), text);
    return item;
  }

  /** @param {Entry} entry */
  function makeOpener(entry) {
    const opener = make("button", "log__open");
    opener.type = "button";
    opener.title = words.t("logpanel.decision");
    opener.addEventListener("click", (event) => {
      event.stopPropagation();
      decision.open(String(entry.decision_id), opener);
    });
    return opener;
  }

  /** A robot may slow down for what iVeg does not know yet. @param {Entry} entry */
  function keyOf({ key, slots }) {
    const isBare = key.startsWith("log.speed_down.") && slots.distance === undefined;
    return isBare && (slots.reason === "person" || slots.reason === "robot")
      ? "log.speed_down"
      : key;
  }

  /** @param {Entry} entry */
  function add(entry) {
    filter.learn(entry);
    if (!filter.admits(entry)) return;
    list.prepend(makeItem(entry));
    while (list.children.length > SHOWN) list.lastElementChild?.remove();
    setHidden(empty, true);
  }

  function rebuild() {
    const entries = store.log();
    for (const entry of entries) filter.learn(entry);
    const shown = entries.filter(filter.admits).slice(-SHOWN).reverse();
    list.replaceChildren(...shown.map(makeItem));
    setHidden(empty, shown.length > 0);
    const key = entries.length ? "logpanel.empty_filter" : "logpanel.empty";
    setText(empty, words.t(key));
  }

  store.subscribe("log", add);
  store.subscribe("snapshot", rebuild);
  words.onChange(() => {
    filter.draw();
    rebuild();
  });
  rebuild();
}

/**
 * @param {App} app
 * @param {() => void} onChange
 */
function createFilter({ store, words }, onChange) {
  const place = need("#log-chips");
  /** @type {Map<string, Set<string>>} what is pressed, by group */
  const pressed = new Map([
    ["kind", new Set()],
    ["robot", new Set()],
    ["class", new Set()],
  ]);
  /** @type {Set<string>} */
  const robots = new Set();

  /** @param {string} group @param {string} name @param {string} text */
  function makeChip(group, name, text) {
    const chip = make("button", "chip", text);
    const names = /** @type {Set<string>} */ (pressed.get(group));
    chip.type = "button";
    chip.dataset.filter = `${group}:${name}`;
    setAttribute(chip, "aria-pressed", String(names.has(name)));
    chip.addEventListener("click", () => {
      if (!names.delete(name)) names.add(name);
      setAttribute(chip, "aria-pressed", String(names.has(name)));
      onChange();
    });
    return chip;
  }

  function draw() {
    for (const robotId of store.robots().keys()) robots.add(robotId);
    place.replaceChildren(
      ...KINDS.map((kind) => makeChip("kind", kind, words.t(`logpanel.kind.${kind}`))),
      ...[...robots].map((robotId) => makeChip("robot", robotId, robotId)),
      ...CLASSES.map((name) => makeChip("class", name, words.t(`class.${name}`))),
    );
  }

  /** @param {string} group @param {string | null} value */
  function isIn(group, value) {
    const names = /** @type {Set<string>} */ (pressed.get(group));
    return names.size === 0 || (value !== null && names.has(value));
  }

  draw();
  return {
    draw,
    /** @param {Entry} entry */
    learn(entry) {
      if (!entry.robot_id || robots.has(entry.robot_id)) return;
      robots.add(entry.robot_id);
      draw();
    },
    /** @param {Entry} entry */
    admits: (entry) =>
      isIn("kind", entry.kind) &&
      isIn("robot", entry.robot_id) &&
      isIn("class", entry.class),
  };
}
