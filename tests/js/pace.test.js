import { createPace } from "../../iveg/static/js/core/pace.js";
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

test("a page that nobody sees says that it draws nothing", () => {
  /** @type {boolean[]} */
  const drawn = [];
  const hidden = Object.getOwnPropertyDescriptor(document, "hidden");
  const pace = createPace(
    (_, isDrawn) => drawn.push(isDrawn),
    (fn) => fn(),
  );
  try {
    for (const [frame, isHidden] of [false, true].entries()) {
      Object.defineProperty(document, "hidden", {
        value: isHidden,
        configurable: true,
      });
      pace.took(frame + 1);
    }
  } finally {
    if (hidden) Object.defineProperty(document, "hidden", hidden);
    else Reflect.deleteProperty(document, "hidden");
  }
  equal(drawn, [true, false]);
});
