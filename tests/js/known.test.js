import { Store } from "../../iveg/static/js/core/store.js";
import { idOfKnown, pick } from "../../iveg/static/js/map/layers/pick.js";
import { createViewport, fitTo } from "../../iveg/static/js/map/viewport.js";
import { createKnownSaid } from "../../iveg/static/js/panels/known_said.js";
import { equal, test } from "./harness.js";

const SPOT = { x: 2, y: 1, radius_m: 0.3, since: "2026-11-24T09:12:40Z" };
const LEARNT = { ...SPOT, thing_id: null };
const MARKED = { ...SPOT, x: 5, thing_id: "T1" };
const PERSON = { x: 5, y: 1, id: "P1", stage: "last_seen", ringM: 0 };
const VIEW = fitTo(createViewport(600, 400), { xmin: 0, ymin: 0, xmax: 6, ymax: 4 }, 0);

/** What a tap on a place finds. @param {{x: number, y: number}} at @param {boolean} isOn */
function picked({ x, y }, isOn = true) {
  const scene = { robots: [], people: [PERSON], detections: [], known: null };
  const known = { items: [LEARNT, MARKED] };
  const [px, py] = [100 * x, 400 - 100 * y];
  const shown = (/** @type {string} */ layer) => layer !== "known" || isOn;
  return pick(/** @type {any} */ ({ ...scene, known }), VIEW, px, py, shown);
}

test("a place that is known is found by a tap, and never before a person", () => {
  equal(picked(SPOT), { kind: "known", id: idOfKnown(LEARNT) });
  equal(picked(MARKED), { kind: "person", id: "P1" });
  equal(picked({ x: 3.5, y: 3 }), null);
  equal(picked(SPOT, false), null);
});

test("the map says since when a place is known, for as long as it is", () => {
  const place = document.createElement("p");
  place.id = "known-said";
  document.body.replaceChildren(place);
  /** @type {(() => void)[]} */
  const frames = [];
  const store = new Store({ schedule: (flush) => frames.push(flush) });
  const i18n = {
    t: (/** @type {string} */ key, /** @type {{since: string}} */ { since }) =>
      `${key} ${since}`,
    time: (/** @type {string} */ at) => at.slice(11, 19),
    onChange: () => () => {},
  };
  const say = createKnownSaid(/** @type {any} */ ({ store, i18n }));
  store.apply("known-here", { items: [LEARNT, MARKED] });

  say(idOfKnown(MARKED));
  equal([place.textContent, place.hidden], ["map.known_marked 09:12", false]);
  say(idOfKnown(LEARNT));
  equal(place.textContent, "map.known_learnt 09:12");
  store.apply("known-here", { items: [MARKED] });
  for (const flush of frames) flush();
  equal(place.hidden, true);
  say(null);
  equal(place.textContent, "");
});
