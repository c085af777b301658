import { createAbove } from "../../iveg/static/js/map/layers/above.js";
import { draw as drawPeople } from "../../iveg/static/js/map/layers/people.js";
import { createPlaces } from "../../iveg/static/js/map/layers/places.js";
import { createSprites } from "../../iveg/static/js/map/layers/sprites.js";
import { equal, test } from "./harness.js";

const VIEW = { width: 200, height: 150, scale: 20, x: 0, y: 0 };
const THEME = {
  ...{ bg: "#fff", ring: "#c00", person: "#600", peer: "#060" },
  ...{ muted: "#888", text: "#000", font: "monospace" },
};
const said = (/** @type {number} */ s) => `${s.toFixed(1)} s`;
const LABELS = { age: said, ago: said };

/** Somebody with a ring of two metres. @param {object} [changes] */
const someone = (changes) => ({
  ...{ x: 0, y: 0, ringM: 2, ageS: 0, stage: "seen", peer: false, isThing: false },
  ...{ confidence: 1, observers: [], acting: [] },
  ...changes,
});

/** Twelve at nearly one place, where one image is fewer pixels than theirs.
 * @param {object} [changes] of the last one */
const crowd = (changes) =>
  Array.from({ length: 12 }, (_, n) =>
    someone({ x: 0.1 * n, y: 0.05 * n, ...(n === 11 ? changes : {}) }),
  );

/** @param {object[]} people @param {number} [nowMs] @param {number} [ratio] */
function paintOf(people, nowMs = 0, ratio = 1) {
  const canvas = new OffscreenCanvas(VIEW.width * ratio, VIEW.height * ratio);
  const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
    canvas.getContext("2d", { alpha: false, willReadFrequently: true })
  );
  ctx.fillStyle = "#fff";
  ctx.fillRect(0, 0, canvas.width, canvas.height);
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  const scene = { people, robots: [], nowMs, map: null, coverage: null, costmap: null };
  const paint = { ctx, ratio, view: VIEW, theme: THEME, labels: LABELS, scene };
  const told = { ...paint, sprites: createSprites(), places: createPlaces() };
  return /** @type {import("../../iveg/static/js/map/layers/paint.js").Paint} */ (
    /** @type {unknown} */ (told)
  );
}

/** The drawing of people, and how often it was asked for. */
function counted() {
  const told = { drawn: 0 };
  const draw = createAbove((paint) => {
    told.drawn += 1;
    drawPeople(paint);
  });
  return { told, draw };
}

/** @param {ReturnType<typeof paintOf>} paint */
const pixelsOf = ({ ctx }) =>
  ctx.getImageData(0, 0, ctx.canvas.width, ctx.canvas.height).data;

test("a crowd that is copied looks as it does when it is drawn", () => {
  for (const ratio of [1, 1.5, 2]) {
    const [drawn, copied] = [drawPeople, counted().draw].map((draw) => {
      const paint = paintOf(crowd({ stage: "remembered", ageS: 4 }), 0, ratio);
      draw(paint);
      return pixelsOf(paint);
    });
    const most = drawn.reduce((m, it, i) => Math.max(m, Math.abs(it - copied[i])), 0);
    // Twelve rings lie on each other, and each is rounded once more.
    equal([most <= 12, drawn.some((value) => value < 120)], [true, true]);
  }
});

test("a crowd is drawn once until somebody of it moves, goes or is seen otherwise", () => {
  const { told, draw } = counted();
  /** @param {object[]} people */
  const after = (people) => {
    draw(paintOf(people));
    return told.drawn;
  };
  equal([after(crowd()), after(crowd())], [1, 1]);
  equal([after(crowd({ x: 2 })), after(crowd().slice(1))], [2, 3]);
  equal([after(crowd({ ringM: 3 })), after(crowd({ isThing: true }))], [4, 5]);
});

test("a crowd that nobody sees grows older ten times a second, whoever is told", () => {
  const { told, draw } = counted();
  const at = (/** @type {number} */ nowMs) => {
    draw(paintOf(crowd({ stage: "remembered", ageS: 4 }), nowMs));
    return told.drawn;
  };
  equal([at(0), at(50), at(100), at(150), at(1000)], [1, 1, 2, 2, 3]);
});

test("the age of somebody keeps its place from one drawing to the next", () => {
  const { draw } = counted();
  const people = crowd({ x: 3, stage: "remembered", ageS: 4 });
  const kept = [0, 10].map((nowMs) => {
    const paint = paintOf(people, nowMs);
    draw(paint);
    return paint.places?.labels();
  });
  equal([kept[0]?.length, kept[0]], [1, kept[1]]);
});

test("a few people are drawn themselves", () => {
  const { told, draw } = counted();
  const few = [someone({ x: -4, ringM: 0.5 }), someone({ x: 4, ringM: 0.5 })];
  draw(paintOf(few));
  draw(paintOf(few));
  draw(paintOf([]));
  equal(told.drawn, 3);
});
