import { createPace, createScreen, withWait } from "../../iveg/static/js/core/pace.js";
import { createPainting } from "../../iveg/static/js/core/painting.js";
import { equal, test } from "./harness.js";

/** A pace whose screen paints when the test says so. */
function paceByHand() {
  /** @type {(() => void)[]} */
  const asked = [];
  /** @type {number[]} */
  const said = [];
  const pace = createPace(
    (frame) => said.push(frame),
    (fn) => asked.push(fn),
  );
  const paint = () => {
    for (const fn of asked.splice(0)) fn();
  };
  return { pace, paint, said };
}

test("nothing is said before it is painted", () => {
  const { pace, paint, said } = paceByHand();
  pace.took(1);
  equal(said, []);
  paint();
  equal(said, [1]);
});

test("of the frames between two paintings the newest is said, once", () => {
  const { pace, paint, said } = paceByHand();
  for (const frame of [1, 2, 3]) pace.took(frame);
  paint();
  paint();
  pace.took(4);
  paint();
  equal(said, [3, 4]);
});

test("a page that is not painted says seldom, but says", async () => {
  /** @type {number[]} */
  const said = [];
  const real = globalThis.requestAnimationFrame;
  globalThis.requestAnimationFrame = () => 0;
  try {
    createPace((frame) => said.push(frame), createPainting().when).took(1);
  } finally {
    globalThis.requestAnimationFrame = real;
  }
  await new Promise((done) => setTimeout(done, 500));
  equal(said, []);
  await new Promise((done) => setTimeout(done, 700));
  equal(said, [1]);
});

test("the screen's next frame is known from when those began that were drawn", () => {
  const screen = createScreen();
  equal(screen.nextMs(107, 100), 0);
  equal(Math.round(screen.nextMs(122, 116.7)), 11);
  equal(Math.round(screen.nextMs(160, 150)), 7);
});

test("a picture that took longer than a frame of the screen waits for the one after", () => {
  const screen = createScreen();
  screen.nextMs(107, 100);
  equal(Math.round(screen.nextMs(137, 116.7)), 13);
});

test("where seldom anything is drawn the screen is taken for a usual one", () => {
  const screen = createScreen();
  screen.nextMs(105, 100);
  equal(Math.round(screen.nextMs(155, 150)), 12);
});

test("what nobody drew says nothing of the screen", () => {
  equal(createScreen().nextMs(100), 0);
});

test("the next frame may wait as long as it still comes in time, the way there counted", () => {
  const drawn = { at: 7, within: 0.001 };
  equal(withWait(drawn, 12), { ...drawn, wait: 0.005 });
  equal(withWait(drawn, 3), { ...drawn, wait: 0 });
  equal(withWait({ at: 7, within: 0.15 }, 12), { at: 7, within: 0.15, wait: 0 });
});
