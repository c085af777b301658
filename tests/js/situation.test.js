import { fleetSaid } from "../../iveg/static/js/core/fleet_said.js";
import { createI18n } from "../../iveg/static/js/core/i18n.js";
import { situationOf } from "../../iveg/static/js/core/situation.js";
import { createCardOrder, sorted } from "../../iveg/static/js/panels/card_order.js";
import {
  createCalm,
  LASTS_MS,
  ofConnection,
} from "../../iveg/static/js/panels/status_line.js";
import { robot, situation } from "./builders.js";
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

/** @param {import("./builders.js").Robot[]} fleet */
const said = (fleet) => fleetSaid(fleet, EN, NOW_MS);

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
