/**
 * "Not a person here": an operator marks a thing that cameras take for a person, and takes
 * marks back, in the list of people.  A mark lowers protection, so it is asked twice; the
 * second press counts only for what the first one was for.
 */

import { readApi, sendApi } from "../core/api.js";
import { dayAndTime } from "../pages/history/local_time.js";
import { fill, make, need, setHidden, setText } from "./dom.js";

/**
 * @typedef {import("../core/protocol.js").Person} Person
 * @typedef {import("../types.js").Thing} Thing
 */

const MARKERS = new Set(["operator", "admin"]);
const mayMark = () => MARKERS.has(document.body.dataset.role ?? "");
/** So long a first press waits for its second. */
const ASKED_MS = 8000;
/** @param {import("../core/i18n.js").I18n} i18n */
export function createThings(i18n) {
  const list = need("#things-list");
  /** @type {Thing[]} */
  let things = [];
  /** @type {{id: string, untilMs: number} | null} */
  let asked = null;

  /** Whether a button waits for its second press. @param {string} id */
  const isAsked = (id) => asked?.id === id && performance.now() < asked.untilMs;

  function makeItem() {
    const item = make("li");
    const button = makeButton((id) => press(button, id));
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

  /** @param {HTMLButtonElement} button @param {string} id of whom it marks */
  async function press(button, id) {
    if (!isAsked(id)) {
      asked = { id, untilMs: performance.now() + ASKED_MS };
      setText(button, i18n.t("things.sure"));
      return say("things.asked");
    }
    asked = null;
    const { status, body } = await sendApi("POST", "things", { person_id: id });
    tell(status, body, "things.marked");
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
    if (!people.some(({ person_id }) => person_id === asked?.id)) asked = null;
  }

  /** The button of a person's item. @param {Element} item @param {Person} person */
  function write(item, person) {
    const button = /** @type {HTMLButtonElement} */ (need("button", item));
    const { person_id, thing_id } = person;
    setHidden(button, !mayMark() || person.class !== "person" || thing_id !== null);
    button.dataset.of = person_id;
    setText(button, i18n.t(isAsked(person_id) ? "things.sure" : "things.mark"));
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
      setText(need("p", item), i18n.t("things.one", slots));
      const button = /** @type {HTMLButtonElement} */ (need("button", item));
      button.dataset.of = thing.thing_id;
      setText(button, i18n.t("things.unmark"));
      setHidden(button, !mayMark());
    });
  }

  function makeMark() {
    const item = make("li");
    item.append(make("p"), makeButton(takeBack));
    return item;
  }

  i18n.onChange(draw);
  return { makeItem, write, keep, renew };
}
