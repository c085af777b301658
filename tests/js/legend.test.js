import { hatchAt } from "../../iveg/static/js/map/layers/coverage.js";
import { createLabels } from "../../iveg/static/js/map/layers/labels.js";
import { createChoices } from "../../iveg/static/js/map/layers/memory.js";
import { createPlaces } from "../../iveg/static/js/map/layers/places.js";
import { LAYERS } from "../../iveg/static/js/map/picture.js";
import { hiddenSaid } from "../../iveg/static/js/panels/hidden_layers.js";
import { paintSign, SIGNS } from "../../iveg/static/js/panels/legend.js";
import { coverageSaid, createMapFacts } from "../../iveg/static/js/panels/map_facts.js";
import { person } from "./builders.js";
import { equal, test } from "./harness.js";

const words = /** @type {any} */ ({ t: (/** @type {string} */ key) => key });

test("13.3: the legend explains a sign of every layer", () => {
  const explained = new Set(SIGNS.map(({ layer }) => layer));
  equal(
    LAYERS.filter((layer) => !explained.has(layer)),
    [],
  );
});

test("13.3: each sign is drawn by its layer", () => {
  const map = document.createElement("canvas");
  map.id = "map";
  document.body.replaceChildren(map);
  const blank = SIGNS.filter((sign) => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [88, 56];
    paintSign(canvas, sign, createLabels(words.t, "en"));
    const { data } = /** @type {CanvasRenderingContext2D} */ (
      canvas.getContext("2d")
    ).getImageData(0, 0, 88, 56);
    return data.every((value, i) => value === data[i % 4]);
  });
  equal(
    blank.map(({ name }) => name),
    [],
  );
});

test("the age of a late robot is written in the ink of its ground", () => {
  const canvas = document.createElement("canvas");
  canvas.id = "map";
  canvas.style.setProperty("--on-alert-2", "#123456");
  document.body.replaceChildren(canvas);
  const ctx = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  /** @type {unknown[]} */
  const written = [];
  ctx.fillText = (text) => written.push([text, ctx.fillStyle]);
  const late = SIGNS.filter(({ name }) => name === "late");
  for (const sign of late) paintSign(canvas, sign, createLabels(words.t, "en"));
  equal(written.at(-1), ["1.8 s", "#123456"]);
});

test("no words of a sign are cut off", () => {
  const words = /** @type {any} */ ({
    t: (/** @type {string} */ key) => (key === "map.ghost" ? "hace 5 s" : "m"),
  });
  /** @type {string[]} */
  const cut = [];
  for (const sign of SIGNS) {
    const canvas = document.createElement("canvas");
    const ctx = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    ctx.fillText = (text, x) => {
      const { a, c, e, d } = ctx.getTransform();
      if (c !== 0) return;
      const width = ctx.measureText(text).width;
      const left = x - (ctx.textAlign === "center" ? width / 2 : 0);
      const [from, to] = [left * a + e, (left + width) * a + e];
      if (from < 0 || to > 88 * d) cut.push(`${sign.name}: ${text}`);
    };
    paintSign(canvas, sign, createLabels(words.t, "es"));
  }
  equal(cut, []);
});

test("13.17: the costmap is off until somebody switches it on", () => {
  const choices = createChoices(null, () => {});
  equal([choices.isOn("costmap"), choices.isOn("coverage")], [false, true]);
});

test("13.21: the longer nobody has looked, the denser; never is densest", () => {
  equal([9, 10, 59, 60, 599, 600].map(hatchAt), [0, 0.16, 0.16, 0.28, 0.28, 0.42]);
  equal(hatchAt(null), hatchAt(600));
});

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

test("13.11 layers that are switched off are named on the map", () => {
  const words = {
    t: (/** @type {string} */ key, /** @type {object} */ slots = {}) =>
      [key, ...Object.values(slots)].join(" "),
  };
  const layers = (/** @type {string[]} */ ...off) =>
    ["grid", "people", "robots", "costmap"].map((name) => ({
      name,
      on: !off.includes(name),
    }));
  equal(hiddenSaid(layers(), words), "");
  equal(hiddenSaid(layers("grid", "costmap"), words), "");
  equal(
    hiddenSaid(layers("people", "robots"), words),
    "map.hidden map.layer.people, map.layer.robots",
  );
});

test("13.19 words give way to words that stand there already", () => {
  const places = createPlaces();
  const at = (/** @type {number} */ left, /** @type {number} */ top) => ({
    ...{ left, right: left + 60, top, bottom: top + 20 },
  });
  equal(places.claim([at(0, 0)]), 0);
  equal(places.claim([at(30, 10), at(30, 40)]), 1);
  equal(places.claim([at(10, 5), at(50, 45)]), null);
  equal(places.claim([at(70, 0)]), 0);
});
