import { createPainting } from "../../iveg/static/js/core/painting.js";
import { createFrames } from "../../iveg/static/js/map/frames.js";
import { equal, test } from "./harness.js";

/** @param {number} [count] */
async function framesOfTheScreen(count = 1) {
  for (let n = 0; n < count; n += 1) {
    await new Promise((done) => requestAnimationFrame(done));
  }
}

/** Frames whose pictures are counted. @param {(n: number) => number | null} [missingMs] */
function counted(missingMs = () => /** @type {number | null} */ (0)) {
  const told = { drawn: 0 };
  const frames = createFrames(() => {
    told.drawn += 1;
    return missingMs(told.drawn);
  });
  return { frames, told };
}

test("however many ask, there is one picture, in the screen's next frame", async () => {
  const { frames, told } = counted();
  for (let n = 0; n < 50; n += 1) frames.ask();
  equal(told.drawn, 0);
  await framesOfTheScreen(3);
  equal(told.drawn, 1);
});

test("who asks is told once, after the picture", async () => {
  const { frames, told } = counted();
  /** @type {number[]} */
  const heard = [];
  frames.afterDrawn(() => heard.push(told.drawn));
  equal(heard, []);
  await framesOfTheScreen();
  frames.ask();
  await framesOfTheScreen(2);
  equal(heard, [1]);
});

test("scans that are not in a picture are drawn when they may be", async () => {
  const { frames, told } = counted((n) => (n === 1 ? 30 : 0));
  /** @type {boolean[]} */
  const heard = [];
  frames.onDrawn((hasScans) => heard.push(hasScans));
  frames.ask();
  await new Promise((done) => setTimeout(done, 200));
  equal([told.drawn, heard], [2, [false, true]]);
});

test("where there is no place nobody is told of a picture", async () => {
  const { frames } = counted((n) => (n === 1 ? null : 0));
  let heard = 0;
  frames.onDrawn(() => {
    heard += 1;
  });
  for (const wanted of [0, 1]) {
    frames.ask();
    await framesOfTheScreen(2);
    equal(heard, wanted);
  }
});

test("who asks again when it is told waits for the next picture", async () => {
  const { frames, told } = counted();
  let heard = 0;
  const again = () => {
    heard += 1;
    if (heard < 3) frames.afterDrawn(again);
  };
  frames.afterDrawn(again);
  await framesOfTheScreen(6);
  equal([told.drawn, heard], [3, 3]);
});

test("after its end nothing is drawn", async () => {
  const { frames, told } = counted();
  frames.ask();
  frames.end();
  await framesOfTheScreen(2);
  equal(told.drawn, 0);
});

test("a page without a map has painted in its next frame", async () => {
  const painting = createPainting();
  await new Promise((done) => painting.when(() => done(null)));
  let late = 0;
  painting.follow({ afterDrawn() {} });
  await new Promise((done) =>
    painting.when(() => {
      late += 1;
      done(null);
    }),
  );
  equal(late, 1);
});
