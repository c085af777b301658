import { draw as drawPeople } from "../../iveg/static/js/map/layers/people.js";
import { createSprites } from "../../iveg/static/js/map/layers/sprites.js";
import { equal, test } from "./harness.js";

const SIZE = 120;
const THEME = { bg: "#fff", ring: "#c00", person: "#600", peer: "#060", muted: "#888" };

function context() {
  const canvas = new OffscreenCanvas(SIZE, SIZE);
  const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
    canvas.getContext("2d", { alpha: false, willReadFrequently: true })
  );
  ctx.fillStyle = THEME.bg;
  ctx.fillRect(0, 0, SIZE, SIZE);
  return ctx;
}

/** Somebody in the middle who is seen, as a layer gets it. @param {object} [changes] */
function paintOf(changes = {}) {
  const someone = { ageS: 0, x: 0, y: 0, ringM: 2, peer: false, stage: "seen" };
  const view = { width: SIZE, height: SIZE, scale: 20, x: 0, y: 0 };
  const told = { ctx: context(), view, theme: THEME, scene: { people: [someone] } };
  return /** @type {any} */ ({ ...told, ...changes });
}

/** @param {OffscreenCanvasRenderingContext2D} ctx */
const pixelsOf = (ctx) => ctx.getImageData(0, 0, SIZE, SIZE).data;

test("a sign that is copied looks as it does when it is drawn", () => {
  for (const peer of [false, true]) {
    const people = [{ ...paintOf().scene.people[0], peer }];
    const [drawn, copied] = [{}, { sprites: createSprites() }].map((kept) => {
      const paint = paintOf({ ...kept, scene: { people } });
      drawPeople(paint);
      return pixelsOf(paint.ctx);
    });
    equal(
      drawn.some((value) => value < 200),
      true,
    );
    const most = drawn.reduce(
      (m, value, i) => Math.max(m, Math.abs(value - copied[i])),
      0,
    );
    equal(most <= 2, true);
  }
});

/** How often a sign is drawn, which reaches so far. @param {number} [reach] */
function counted(reach = 20) {
  const sprites = createSprites();
  const told = { drawn: 0 };
  /** @param {string} name @param {object} [changes] */
  function draw(name, changes) {
    sprites.copy(paintOf(changes), { name, reach, x: 60, y: 60 }, () => {
      told.drawn += 1;
    });
    return told.drawn;
  }
  return draw;
}

test("what looks alike is drawn once, and anew for another look", () => {
  const draw = counted();
  equal([draw("one"), draw("one"), draw("other"), draw("one")], [1, 1, 2, 2]);
  equal([draw("one", { ratio: 2 }), draw("one", { theme: { ...THEME } })], [3, 4]);
});

test("a large sign is drawn itself, not kept", () => {
  const draw = counted(300);
  equal([draw("one"), draw("one")], [1, 2]);
});

test("images of sizes that a zoom left behind are not kept for ever", () => {
  const draw = counted(250);
  for (let n = 0; n < 30; n += 1) draw(`size ${n}`);
  equal([draw("size 29"), draw("size 0")], [30, 31]);
});
