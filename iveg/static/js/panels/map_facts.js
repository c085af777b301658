/**
 * The facts over the map: people, coverage by cameras, climate, age of the costmap.
 *
 * All are drawn anew each second: without news they grow old, and must say so.
 */

import { onBeat } from "../core/beat.js";
import { ageOf } from "../core/clock.js";
import { readPerson } from "../map/scene.js";
import { CLIMATE_OLD_S, climateAgo } from "./climate_texts.js";
import { need, setHidden, setText } from "./dom.js";

/** @typedef {import("../core/protocol.js").Person} Person */

const AGE_MS = 1000;
/** The coverage is polled every two seconds. */
const COVERAGE_OLD_S = 6;

/**
 * @param {import("../main.js").App} app
 * @param {import("./mapbox.js").LiveMap} map
 * @returns {() => void} draws all of them
 */
export function createMapFacts({ store, i18n }, map) {
  function drawPeople() {
    const isOpen = store.connection.state === "open";
    const said = peopleSaid(store.people(), store.get("coverage"), isOpen, i18n);
    setText(need("#people-count"), said);
    const about = isOpen ? store.people().filter(isPresent) : [];
    const acting = about.flatMap((person) => person.acting);
    const unseen = acting.filter((it) => !it.in_sight);
    const nlos = need("#nlos-count");
    setHidden(nlos, unseen.length === 0);
    const slowed = new Set(unseen.map(({ robot_id }) => robot_id)).size;
    const key = slowed === 1 ? "map.nlos_one" : "map.nlos_count";
    setText(nlos, i18n.t(key, { count: slowed }));
  }

  function drawCostmapAge() {
    /** @type {import("../core/protocol.js").Costmap | undefined} */
    const costmap = store.get("costmap");
    const isOn = map.layers().some(({ name, on }) => name === "costmap" && on);
    const isKnown = typeof costmap?.age_s === "number";
    const key = isKnown ? "map.costmap_age" : "map.costmap_none";
    setHidden(need("#costmap-age"), !isOn);
    setText(
      need("#costmap-age"),
      i18n.t(key, { age: costmap && isKnown ? ageOf(costmap) : 0 }),
    );
  }

  function drawClimate() {
    /** @type {import("../core/protocol.js").Climate | null | undefined} */
    const climate = store.get("climate");
    const said = [
      ["temperature", climate?.temperature],
      ["humidity", climate?.relative_humidity],
      ["co2", climate?.co2],
    ]
      .filter(([, value]) => typeof value === "number")
      .map(([name, value]) => i18n.t(`climate.${name}`, { value }));
    setHidden(need("#climate"), said.length === 0);
    const age = climate ? ageOf(climate) : 0;
    if (said.length && age > CLIMATE_OLD_S) said.push(climateAgo(age, i18n));
    setText(need("#climate"), said.join(" · "));
  }

  function draw() {
    drawPeople();
    drawCostmapAge();
    drawClimate();
  }

  setInterval(onBeat, AGE_MS, draw);
  store.subscribe("people", drawPeople);
  store.subscribe("coverage", drawPeople);
  store.subscribe("connection", drawPeople);
  store.subscribe("costmap", drawCostmapAge);
  store.subscribe("climate", drawClimate);
  return draw;
}

/**
 * The share of the lanes within sight of cameras, as a text; blind when there is none.
 *
 * @param {import("../core/protocol.js").Coverage | undefined} coverage
 * @param {import("../core/i18n.js").I18n} i18n
 * @returns {{text: string, isBlind: boolean}}
 */
export function coverageSaid(coverage, i18n) {
  if (!coverage) return { text: i18n.t("map.coverage_unknown"), isBlind: true };
  const isOld =
    ageOf({ age_s: 0, receivedAtMs: coverage.receivedAtMs }) > COVERAGE_OLD_S;
  if (isOld) return { text: i18n.t("map.coverage_unknown"), isBlind: true };
  if (!coverage.cameras) return { text: i18n.t("map.coverage_blind"), isBlind: true };
  if (coverage.share === null) return { text: "", isBlind: false };
  const share = Math.floor(coverage.share * 100) / 100;
  return { text: i18n.t("map.coverage_share", { share }), isBlind: false };
}

/**
 * Who is there: seen now, or seen lately and remembered; nobody sees without a camera, and
 * nobody knows without the server.
 *
 * @param {readonly Person[]} people
 * @param {import("../core/protocol.js").Coverage | undefined} coverage
 * @param {boolean} isOpen whether this screen hears the server
 * @param {import("../core/i18n.js").I18n} i18n
 */
export function peopleSaid(people, coverage, isOpen, i18n) {
  if (!isOpen) return i18n.t("map.people_no_link");
  const stages = people.filter(isPresent).map(stageOf);
  const said = coverageSaid(coverage, i18n);
  const seen = said.isBlind ? 0 : stages.filter((stage) => stage === "seen").length;
  const lately = stages.length - seen;
  const parts = [
    seen && i18n.t(seen === 1 ? "map.people_one" : "map.people_count", { count: seen }),
    lately && i18n.t(latelyKey(lately, seen), { count: lately }),
    !seen && !lately && !said.isBlind && i18n.t("map.people_none"),
    said.text,
  ];
  return parts.filter(Boolean).join(" · ");
}

/** @param {number} lately @param {number} seen */
const latelyKey = (lately, seen) =>
  seen ? "map.people_also" : `map.people_lately${lately === 1 ? "_one" : ""}`;

/** As the map shows it. @param {Person} person */
const stageOf = (person) => readPerson(person, performance.now()).stage;

/** Whether somebody is still about: silence makes people of the past.
 * @param {Person} person */
const isPresent = (person) =>
  person.class === "person" && stageOf(person) !== "last_seen";
