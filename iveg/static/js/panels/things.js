/**
 * "Not a person here" and "Known here": an operator marks a thing that cameras take for a
 * person, or that a robot's laser sees and no plan draws, and takes marks back, in the
 * list of people.  A mark lowers protection, so it is asked twice; the second press counts
 * only for what the first one was for.
 */

import { readApi, sendApi } from "../core/api.js";
import { dayAndTime } from "../pages/history/local_time.js";
import { fill, make, need, setHidden, setText } from "./dom.js";

/**
 * @typedef {import("../core/protocol.js").Person} Person
 * @typedef {import("../core/protocol.js").Robot} Robot
 * @typedef {import("../types.js").Thing} Thing
 */

/** What is said of a mark, by its kind. */
const WORDS = {
  person: {
    mark: "things.mark",
    sure: "things.sure",
    asked: "things.asked",
    marked: "things.marked",
    one: "things.one",
  },
  obstacle: {
    mark: "things.known_mark",
    sure: "things.known_sure",
    asked: "things.known_asked",
    marked: "things.known_marked",
    one: "things.known_one",
  },
};
const MARKERS = new Set(["operator", "admin"]);
const mayMark = () => MARKERS.has(document.body.dataset.role ?? "");
/** So long a first press waits for its second. */
const ASKED_MS = 8000;
/** So long after a robot was slow for it something may be marked; the server's, too. */
const SHOWN_MS = 10000;

/** @typedef {{person_id: string} | {robot_id: string}} What of which person, or robot */

/** @param {import("../core/i18n.js").I18n} i18n */
export function createThings(i18n) {
  const list = need("#things-list");
  /** When each robot was slow for its laser. @type {Map<string, number>} */
  const slowedMs = new Map();
  /** @type {Thing[]} */
  let things = [];
  /** @type {{id: string, untilMs: number} | null} */
  let asked = null;

  /** Whether a button waits for its second press. @param {string} id */
  const isAsked = (id) => asked?.id === id && performance.now() < asked.untilMs;

  function makeItem() {
    const item = make("li");
    const button = makeButton((id) =>
      press(button, id, { person_id: id }, WORDS.person),
    );
    item.append(make("b"), make("small"), make("p"), button);
    return item;
  }

  /** @param {(id: string) => void} pressed with the id of what it stands beside then */
  function makeButton(pressed) {
    const button = make("button", "button");
    button.type = "button";
    button.addEventListener("click", () => pressed(button.dataset.of ?? ""));
    return button;
  }

  /**
   * @param {HTMLButtonElement} button
   * @param {string} id of what it marks
   * @param {What} what
   * @param {typeof WORDS.person} words
   */
  async function press(button, id, what, words) {
    if (!isAsked(id)) {
      asked = { id, untilMs: performance.now() + ASKED_MS };
      setText(button, i18n.t(words.sure));
      return say(words.asked);
    }
    asked = null;
    const { status, body } = await sendApi("POST", "things", what);
    tell(status, body, words.marked);
    return renew();
  }

  /** @param {string} thingId */
  async function takeBack(thingId) {
    const { status, body } = await sendApi("DELETE", `things/${thingId}`, {});
    tell(status, body, "things.unmarked");
    await renew();
  }

  /** @param {number} status @param {any} body @param {string} done */
  function tell(status, body, done) {
    if (status === 200 || status === 201) return say(done);
    if (status === 0) return say("rows.offline");
    return say(status === 409 ? `things.refused.${body?.why}` : "things.gone");
  }

  /** @param {string} key */
  const say = (key) => setText(need("#people-told"), i18n.t(key));

  /** Forgets a first press whose person is gone. @param {Person[]} people */
  function keep(people) {
    const ids = [...people.map(({ person_id }) => person_id), ...slowedMs.keys()];
    if (asked && !ids.includes(asked.id)) asked = null;
  }

  /** The button of a person's item. @param {Element} item @param {Person} person */
  function write(item, person) {
    const button = /** @type {HTMLButtonElement} */ (need("button", item));
    const { person_id, thing_id } = person;
    setHidden(button, !mayMark() || person.class !== "person" || thing_id !== null);
    button.dataset.of = person_id;
    setText(button, i18n.t(isAsked(person_id) ? WORDS.person.sure : WORDS.person.mark));
  }

  /** What robots are slow for by their lasers. @param {Robot[]} robots */
  function drawSlowed(robots) {
    const nowMs = performance.now();
    for (const { robot_id, speed_limit } of robots) {
      if (speed_limit.reason === "obstacle") slowedMs.set(robot_id, nowMs);
    }
    for (const [robot, atMs] of slowedMs) {
      if (nowMs - atMs > SHOWN_MS) slowedMs.delete(robot);
    }
    fill(
      need("#slowed-list"),
      mayMark() ? [...slowedMs.keys()] : [],
      makeSlowed,
      writeSlowed,
    );
  }

  function makeSlowed() {
    const button = makeButton((id) =>
      press(button, id, { robot_id: id }, WORDS.obstacle),
    );
    return makeLine(button);
  }

  /** A sentence with a button. @param {HTMLElement} button */
  function makeLine(button) {
    const item = make("li");
    item.append(make("p"), button);
    return item;
  }

  /** @param {Element} item @param {string} robot */
  function writeSlowed(item, robot) {
    const button = /** @type {HTMLButtonElement} */ (need("button", item));
    button.dataset.of = robot;
    setText(need("p", item), i18n.t("things.known_beside", { robot }));
    setText(button, i18n.t(isAsked(robot) ? WORDS.obstacle.sure : WORDS.obstacle.mark));
  }

  async function renew() {
    const { status, body } = await readApi("things");
    if (status === 200) things = body.items;
    draw();
  }

  function draw() {
    setHidden(need("#things-title"), things.length === 0);
    fill(list, things, makeMark, (item, thing) => {
      const slots = { ...thing, until: dayAndTime(thing.until) };
      setText(need("p", item), i18n.t(WORDS[thing.kind].one, slots));
      const button = /** @type {HTMLButtonElement} */ (need("button", item));
      button.dataset.of = thing.thing_id;
      setText(button, i18n.t("things.unmark"));
      setHidden(button, !mayMark());
    });
  }

  const makeMark = () => makeLine(makeButton(takeBack));

  i18n.onChange(draw);
  return { makeItem, write, keep, drawSlowed, renew };
}
