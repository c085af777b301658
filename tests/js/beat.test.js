import { createBeat } from "../../iveg/static/js/core/beat.js";
import { equal, test } from "./harness.js";

/** A beat whose frames come when the test says so. */
function beatByHand() {
  /** @type {(() => void)[]} */
  const asked = [];
  const onBeat = createBeat((beat) => void asked.push(beat));
  const frame = () => {
    for (const beat of asked.splice(0)) beat();
  };
  return { onBeat, frame, asked };
}

test("what is asked for before a beat is done in one frame, each thing once", () => {
  const { onBeat, frame, asked } = beatByHand();
  /** @type {string[]} */
  const done = [];
  const [a, b] = [() => done.push("a"), () => done.push("b")];
  for (const fn of [a, b, a, a]) onBeat(fn);
  equal([asked.length, done], [1, []]);
  frame();
  equal(done, ["a", "b"]);
});

test("what fails within a beat takes nothing along", () => {
  const { onBeat, frame } = beatByHand();
  const real = globalThis.reportError;
  const done = { reported: 0, after: 0 };
  globalThis.reportError = () => {
    done.reported += 1;
  };
  try {
    onBeat(() => {
      throw new Error("a panel's own");
    });
    onBeat(() => {
      done.after += 1;
    });
    frame();
  } finally {
    globalThis.reportError = real;
  }
  equal(done, { reported: 1, after: 1 });
});
