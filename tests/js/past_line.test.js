import { PastLine, SLOW_MS, waitSaid } from "../../iveg/static/js/core/past_line.js";
import { equal, test } from "./harness.js";

function wired() {
  /** @type {{atS: number, signal: AbortSignal, answer: (status: number) => void}[]} */
  const asked = [];
  /** @type {number[]} */
  const answers = [];
  const clock = { ms: 0 };
  const line = new PastLine(
    ({ status }) => answers.push(status),
    (atS, signal) =>
      new Promise((resolve) => {
        const answer = (/** @type {number} */ status) =>
          resolve({ status, body: null });
        asked.push({ atS, signal, answer });
      }),
    () => clock.ms,
  );
  return { line, asked, answers, clock };
}

const settled = () => new Promise((resolve) => setTimeout(resolve));

test("one question is out at a time, and the newest moment is asked next", async () => {
  const { line, asked, answers } = wired();
  for (const atS of [10, 11, 12]) line.want(atS);
  asked[0].answer(200);
  await settled();
  asked[1].answer(404);
  await settled();

  equal(
    asked.map(({ atS }) => atS),
    [10, 12],
  );
  equal(answers, [200, 404]);
  equal(line.waitedMs, null);
});

test("the page says at once that it opens the past, and when that is slow", () => {
  equal(waitSaid(0, false), "opening");
  equal(waitSaid(300, true), "");
  equal(waitSaid(1500, true), "opening");
  equal(waitSaid(SLOW_MS, true), "slow");
  equal(waitSaid(null, false), "");
});
