/**
 * The people on the map as a list: for screen readers, and with the reasons.
 */

import { onBeat } from "../core/beat.js";
import { ageOf } from "../core/clock.js";
import { readPerson } from "../map/scene.js";
import { fill, need, setHidden, setText } from "./dom.js";
import { createThings } from "./things.js";

/** @typedef {import("../core/protocol.js").Person} Person */

/** A list that changes faster cannot be read aloud. */
const TICK_MS = 1000;

/** @param {import("../main.js").App} app */
export function createPeoplePanel({ store, i18n }) {
  const list = need("#people-list");
  const things = createThings(i18n);

  function draw() {
    if (!(/** @type {HTMLDialogElement} */ (need("#people-panel")).open)) return;
    const people = store.people();
    things.keep(people);
    fill(list, people, things.makeItem, (item, person) => {
      const [who, where, ...rest] = linesOf(person, i18n);
      setText(need("b", item), who);
      setText(need("small", item), where);
      setText(need("p", item), rest.join(". "));
      things.write(item, person);
    });
    const isOpen = store.connection.state === "open";
    setHidden(need("#people-none"), people.length > 0);
    setText(
      need("#people-none"),
      i18n.t(isOpen ? "people.none" : "map.people_no_link"),
    );
    const acting = people.flatMap((person) => person.acting);
    const slots = {
      now: acting.filter(({ in_sight }) => !in_sight).length,
      total: store.log().filter(({ key }) => /^log\.speed_down\..*_nlos$/.test(key))
        .length,
    };
    setText(need("#people-nlos"), i18n.t("people.nlos", slots));
  }

  document.addEventListener("iveg:panel", draw);
  document.addEventListener("iveg:panel", things.renew);
  i18n.onChange(draw);
  setInterval(onBeat, TICK_MS, draw);
  draw();
}

/**
 * One person in sentences: who and where, since when, how sure, who acts on it.
 *
 * @param {Person} person
 * @param {import("../core/i18n.js").I18n} i18n
 * @returns {string[]}
 */
export function linesOf(person, i18n) {
  const { stage, zoneM } = readPerson(person, performance.now());
  const { x, y } = person.position;
  const slots = {
    person: person.person_id,
    lane: person.lane,
    observers: person.observers.join(", "),
    age: ageOf(person),
    confidence: person.confidence,
    radius: zoneM,
    x,
    y,
  };
  const acts = person.acting.map(({ robot_id, distance_m, in_sight }) =>
    i18n.t(in_sight ? "people.acts" : "people.acts_blind", {
      robot: robot_id,
      distance: distance_m,
    }),
  );
  const { evidence } = person;
  const looks =
    evidence && evidence.looks > 1
      ? [i18n.t("people.evidence", { ...evidence, over: evidence.over_s })]
      : [];
  const isWalker = stage === "seen" && person.class_id === "laser";
  const who = i18n.t(person.lane ? "people.who" : "people.who_free", slots);
  return [
    `${who[0].toUpperCase()}${who.slice(1)}`,
    i18n.t("people.where", slots),
    i18n.t(`people.${isWalker ? "walks" : stage}`, slots),
    ...looks,
    ...(person.thing_id ? [i18n.t("things.is")] : []),
    ...acts,
  ];
}
