import { fleetSaid } from "../../iveg/static/js/core/fleet_said.js";
import { createI18n } from "../../iveg/static/js/core/i18n.js";
import {
  isBlind,
  sentenceOf,
  situationOf,
} from "../../iveg/static/js/core/situation.js";
import { createCardOrder, sorted } from "../../iveg/static/js/panels/card_order.js";
import { peopleSaid } from "../../iveg/static/js/panels/map_facts.js";
import {
  createCalm,
  LASTS_MS,
  ofConnection,
} from "../../iveg/static/js/panels/status_line.js";
import { person, robot, situation } from "./builders.js";
import { equal, test } from "./harness.js";
import { all } from "./surfaces.js";

/** @typedef {import("./builders.js").Situation} Situation */

/** @param {"es" | "en"} language */
async function words(language) {
  const load = async () => (await fetch(`/static/i18n/${language}.json`)).json();
  const i18n = createI18n(load);
  await i18n.use(language);
  return i18n;
}

const EN = await words("en");
const NOW_MS = 10_000;

/** A robot heard so long ago (s). @param {number | null} age_s @param {Situation} of */
const heard = (age_s, of, robot_id = "AGI") =>
  robot({ robot_id, age_s, situation: of, receivedAtMs: NOW_MS });

const CLEAR = situation();
const NEAR = situation({
  ...{ level: "caution", kind: "person", state: "half" },
  ...{ cause: "person", why: "person_in" },
  ...{ about: "P1", factor: 0.5, slots: { factor: 0.5, distance: 1.4, lane: "3" } },
});
const NOT_SLOWING = situation({
  ...NEAR,
  ...{ level: "danger", kind: "disobeys", state: "not_slowing" },
});
const STANDING = situation({
  ...{ level: "locked", kind: "locked", state: "standing", action: "release" },
});

test("a clear way grows old by itself: late, lost, and never clear again", () => {
  const ages = [0.1, 1.5, 4, null];
  const found = ages.map((age_s) => situationOf(heard(age_s, CLEAR), NOW_MS));
  equal(
    found.map(({ level, state }) => `${level} ${state}`),
    ["working clear", "doubt late", "doubt lost", "away no_data"],
  );
});

test("silence makes nothing better: a late robot near somebody stays one", () => {
  equal(situationOf(heard(1.5, NEAR), NOW_MS).level, "caution");
  equal(situationOf(heard(9, NEAR), NOW_MS).level, "caution");
  equal(situationOf(heard(9, NOT_SLOWING), NOW_MS), NOT_SLOWING);
  equal(situationOf(undefined, NOW_MS).level, "away");
});

test("what follows an order has the server's own rules while it is late, not lost", () => {
  equal(situationOf(heard(1.5, STANDING), NOW_MS).state, "standing");
  equal(situationOf(heard(9, STANDING), NOW_MS).state, "lost");
});

test("a standstill is as old on the card as on STOP: after 1.5 s nobody knows", () => {
  const { level, state, action } = situationOf(heard(1.6, STANDING), NOW_MS);
  equal([level, state, action], ["doubt", "stood", "as_moving"]);
});

test("without the server no robot hears STOP: each has its own red button", () => {
  const advice = (/** @type {Situation} */ of, /** @type {number} */ age_s) =>
    situationOf(heard(age_s, of), NOW_MS, "lost").action;
  equal(
    [advice(CLEAR, 0.1), advice(CLEAR, 9), advice(STANDING, 1), advice(STANDING, 9)],
    ["red_button", "red_button", "red_button", "red_button"],
  );
  const called = situation({ ...NOT_SLOWING, action: "press_stop" });
  equal(advice(called, 9), "red_button");
  equal(situationOf(undefined, NOW_MS, "lost").action, "red_button");
});

test("card and fleet page say the same of a robot without the server", async () => {
  const { robots } = await all([heard(0.1, STANDING)], 9, "", [], "lost");
  equal(robots[0].row.toLowerCase(), robots[0].line.toLowerCase());
  equal(robots[0].row.includes("situation.do.red_button"), true);
});

test("a camera that is out of service or not being read is none", () => {
  const works = { required: true, missing: false, out_by: null };
  const blind = [
    works,
    { ...works, missing: true },
    { ...works, required: false, missing: false, out_by: "Ana" },
    { ...works, required: false, missing: true },
  ].map((detector) => isBlind(robot({ detector: /** @type {any} */ (detector) })));
  equal(blind, [false, true, true, false]);
});

test("a sentence has what, why and what to do", () => {
  equal(sentenceOf(NEAR, EN), "at half speed: person in aisle 3 at 1.4 m");
  const called = { ...NOT_SLOWING, action: /** @type {const} */ ("press_stop") };
  equal(
    sentenceOf(called, EN),
    "does not slow down: person in aisle 3 at 1.4 m — press STOP",
  );
  const named = { ...NEAR, slots: { ...NEAR.slots, lane: "Vivero" } };
  equal(sentenceOf(named, EN), "at half speed: person in Vivero at 1.4 m");
});

/** @param {import("./builders.js").Robot[]} fleet */
const said = (fleet) => fleetSaid(fleet, EN, NOW_MS);

test("the worst of the fleet is said, of several alike together", () => {
  const fleet = [heard(0, CLEAR, "A"), heard(0, NEAR, "B"), heard(0, NEAR, "C")];
  equal(said(fleet.slice(0, 2)).said, "B: at half speed: person in aisle 3 at 1.4 m");
  equal(said(fleet), {
    level: "caution",
    kind: "person",
    said: "B, C: at half speed: person in aisle 3",
    robotId: "B",
  });
  const other = { ...NEAR, slots: { ...NEAR.slots, lane: "4" } };
  const apart = [heard(0, NEAR, "B"), heard(0, other, "C"), heard(0, CLEAR, "A")];
  equal(said(apart).said, "B, C: at half speed: person near");
  const two = [heard(0, NOT_SLOWING, "A"), heard(0, NOT_SLOWING, "B")];
  equal(said(two).said.endsWith("(+1 in danger)"), true);
});

test("the line follows the order, and has the colour of the gravest of the fleet", () => {
  const doubted = situation({ level: "doubt", kind: "contradiction", state: "held" });
  const fleet = [heard(0, NEAR, "A"), heard(0, doubted, "B"), heard(0, CLEAR, "C")];
  equal([said(fleet).robotId, said(fleet).level], ["B", "caution"]);
  const unknown = situation({ level: "doubt", kind: "stop_unknown", state: "stood" });
  const moved = situation({ level: "danger", kind: "moved", state: "moved" });
  const two = said([heard(0, moved, "A"), heard(0, unknown, "B")]);
  equal([two.robotId, two.level], ["B", "danger"]);
  equal(two.said.endsWith("(+1 in danger)"), true);
});

test("all clear needs every robot: one away, waiting or late is not clear", () => {
  const clear = heard(0, CLEAR, "A");
  const waiting = heard(0, situation({ state: "waiting" }), "B");
  equal(said([clear]).said, "A at work, all clear");
  equal(said([clear, heard(0, CLEAR, "B")]).said, "2 robots at work, all clear");
  equal(said([waiting]).said, "Waiting: B");
  equal(said([clear, waiting]).said, "1 at work, all clear. Waiting: B");
  const replay = heard(0, situation({ state: "replay" }), "C");
  equal(said([waiting, replay]).said, "Nothing to report: B, C");
  const away = said([clear, heard(null, CLEAR, "B")]);
  equal([away.level, away.said], ["away", "Nothing heard yet of B"]);
  equal(said([heard(null, CLEAR)]).said, "No robot has spoken yet");
  equal(said([clear, heard(1.5, CLEAR, "B")]).level, "doubt");
  const flat = situation({
    kind: "battery",
    state: "battery_low",
    slots: { level: 0.15 },
  });
  equal(said([clear, heard(0, flat, "B")]).said, "B: battery at 15%");
  equal(said([]).level, "away");
});

test("cards stand worst first, and as bad in the fleet's order", () => {
  const card = document.createElement("article");
  const all = [CLEAR, STANDING, NEAR, CLEAR, NOT_SLOWING];
  const fleet = all.map((of, i) => ({ id: `R${i}`, card, situation: of }));
  equal(
    sorted(fleet).map(({ id }) => id),
    ["R4", "R2", "R1", "R0", "R3"],
  );
});

test("a card moves once its order has lasted, and never under a finger or in use", () => {
  const place = document.createElement("section");
  const cards = ["A", "B"].map((id) =>
    Object.assign(document.createElement("article"), { id, tabIndex: 0 }),
  );
  place.append(...cards);
  document.body.replaceChildren(place);
  const [first, second] = cards;
  const order = createCardOrder(place);
  const shown = (/** @type {Situation} */ a, /** @type {number} */ ms) => {
    const fleet = [
      { id: "A", card: first, situation: a },
      { id: "B", card: second, situation: NEAR },
    ];
    order.sort(fleet, ms);
    return [...place.children].map(({ id }) => id).join("");
  };
  const touch = (/** @type {string} */ name) =>
    document.dispatchEvent(new PointerEvent(name, { pointerId: 7 }));

  equal([shown(CLEAR, 0), shown(CLEAR, 900)], ["AB", "AB"]);
  touch("pointerdown");
  equal(shown(CLEAR, 5000), "AB");
  touch("pointerup");
  first.focus();
  equal(shown(CLEAR, 5100), "AB");
  first.blur();
  equal(shown(CLEAR, 5200), "BA");
  place.tabIndex = -1;
  place.focus();
  equal([shown(NOT_SLOWING, 5210), shown(NOT_SLOWING, 6220)], ["BA", "AB"]);
  place.blur();
  equal([shown(CLEAR, 6230), shown(CLEAR, 7240)], ["AB", "BA"]);
  equal([shown(NOT_SLOWING, 7300), shown(CLEAR, 7900)], ["BA", "BA"]);
  equal([shown(NOT_SLOWING, 8000), shown(NOT_SLOWING, 9000)], ["BA", "AB"]);
});

test("without the server the line says so, in red", () => {
  equal(ofConnection("lost", 6400, false, EN)?.level, "danger");
  equal(ofConnection("lost", 6400, false, EN)?.said.includes("7\u00a0s"), true);
  equal(ofConnection("signed-out", 0, false, EN)?.level, "danger");
  equal(ofConnection("connecting", 100, false, EN)?.level, "away");
  equal(ofConnection("connecting", 9000, false, EN)?.level, "doubt");
  equal(ofConnection("open", 0, false, EN), null);
});

const RANKS = { danger: 0, caution: 11, working: 17 };

/** @param {keyof typeof RANKS} level */
const told = (level) => ({
  ...{ level, rank: RANKS[level], said: level },
  ...{ about: level, robotId: null },
});

test("what is worse shows at once, what is better once it has lasted", () => {
  const calm = createCalm();
  const seen = [
    ...[calm.take(told("working"), 0), calm.take(told("danger"), 10)],
    ...[calm.take(told("working"), 20), calm.take(told("danger"), 900)],
    ...[calm.take(told("working"), 1000), calm.take(told("working"), 1999)],
    calm.take(told("working"), 1000 + LASTS_MS),
  ];
  equal(
    seen.map(({ shown }) => shown.level),
    ["working", "danger", "danger", "danger", "danger", "danger", "working"],
  );
});

test("only what lasts is read aloud, once, whatever its numbers do", () => {
  const calm = createCalm();
  const aloud = (/** @type {any} */ of, /** @type {number} */ ms) =>
    calm.take(of, ms).aloud?.said ?? null;
  const near = (/** @type {string} */ text) => ({ ...told("caution"), said: text });
  equal(aloud(told("working"), 0), null);
  equal(aloud(told("working"), LASTS_MS), "working");
  equal(aloud(near("1.4 m"), 1100), null);
  equal(aloud(near("1.3 m"), 1500), null);
  equal(aloud(near("1.2 m"), 2100), "1.2 m");
  equal(aloud(near("1.1 m"), 9000), null);
});

test("people who are not seen are not counted as seen, and without a link nobody knows", () => {
  const receivedAtMs = performance.now();
  const now = person({ receivedAtMs });
  const before = person({ stage: "remembered", age_s: 4, receivedAtMs });
  const cameras = /** @type {any} */ ({ cameras: 1, share: 0.5, receivedAtMs });
  const blind = { ...cameras, cameras: 0 };
  equal(peopleSaid([now, now], cameras, true, EN).startsWith("2 people · "), true);
  equal(
    peopleSaid([now, before], cameras, true, EN),
    "1 person · 1 more seen lately · 50% of aisles in view",
  );
  equal(
    peopleSaid([now, now], blind, true, EN),
    "2 people seen lately · No camera coverage",
  );
  equal(peopleSaid([], blind, true, EN), "No camera coverage");
  equal(peopleSaid([], cameras, true, EN), "Nobody seen · 50% of aisles in view");
  equal(peopleSaid([now], cameras, false, EN), "No link: unknown who is there");
});
