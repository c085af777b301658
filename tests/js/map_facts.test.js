import { coverageSaid, createMapFacts } from "../../iveg/static/js/panels/map_facts.js";
import { person } from "./builders.js";
import { equal, test } from "./harness.js";

const words = /** @type {any} */ ({ t: (/** @type {string} */ key) => key });

test("13.21: that nobody is seen is never said when no camera looks", () => {
  const now = performance.now();
  const told = { at: "", within_s: 10, lanes: [], receivedAtMs: now };
  const said = (/** @type {any} */ coverage) => coverageSaid(coverage, words);
  equal(said(undefined), { text: "map.coverage_unknown", isBlind: true });
  equal(said({ ...told, cameras: 0, share: 0.4 }).text, "map.coverage_blind");
  equal(said({ ...told, cameras: 1, share: 0.4 }), {
    text: "map.coverage_share",
    isBlind: false,
  });
  const old = { ...told, receivedAtMs: now - 7000, cameras: 1, share: 1 };
  equal(said(old).isBlind, true);
});

test("without news the facts over the map grow old and say so", () => {
  const facts = ["people-count", "nlos-count", "climate", "costmap-age"].map((id) =>
    Object.assign(document.createElement("span"), { id }),
  );
  document.body.replaceChildren(...facts);
  const receivedAtMs = performance.now();
  /** @type {Record<string, any>} */
  const told = {
    coverage: { cameras: 1, share: 0.4, receivedAtMs },
    climate: { temperature: 28, age_s: 0, receivedAtMs },
  };
  const acting = [{ robot_id: "AGI", distance_m: 1, in_sight: false }];
  const seen = { ...person({ acting }), receivedAtMs };
  const store = {
    people: () => [seen],
    get: (/** @type {string} */ topic) => told[topic],
    subscribe: () => {},
    connection: { state: "open" },
  };
  const map = /** @type {any} */ ({ layers: () => [] });
  const draw = createMapFacts(/** @type {any} */ ({ store, i18n: words }), map);
  const shown = () =>
    facts.slice(0, 3).map(({ hidden, textContent }) => (hidden ? "" : textContent));

  draw();
  equal(shown(), [
    "map.people_one · map.coverage_share",
    "map.nlos_one",
    "climate.temperature",
  ]);
  for (const one of [seen, told.coverage, told.climate]) one.receivedAtMs -= 301_000;
  draw();
  equal(shown(), ["map.coverage_unknown", "", "climate.temperature · climate.ago_min"]);
});
