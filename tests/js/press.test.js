import { createPresser } from "../../iveg/static/js/panels/press.js";
import { equal, test } from "./harness.js";
import { memory } from "./memory.js";

/** A line that notes what it was given. */
function fakeLine() {
  /** @type {{robotId: string | null, pressId: string, pressedAt: number}[]} */
  const sent = [];
  return {
    sent,
    serverNow: () => 1000,
    /** @param {string | null} robotId @param {string} pressId @param {number} pressedAt */
    sendStop(robotId, pressId, pressedAt) {
      sent.push({ robotId, pressId, pressedAt });
      return true;
    },
  };
}

const nothing = () => {};

test("a press that HTTP takes is not repeated over the line", async () => {
  const line = fakeLine();
  const presser = createPresser(line, nothing, async () => 202);
  await presser.press("AGI");
  equal(line.sent, []);
  equal(presser.pending("AGI")?.accepted, true);
});

test("a press that HTTP refuses goes over the line at once, as the same press", async () => {
  const line = fakeLine();
  const presser = createPresser(line, nothing, async () => 401);
  await presser.press("AGI");
  equal(line.sent, [
    { robotId: "AGI", pressId: presser.pending("AGI")?.pressId, pressedAt: 1000 },
  ]);
});

test("a silent HTTP is overtaken by the line after half a second", async () => {
  const line = fakeLine();
  /** @type {(status: number) => void} */
  let answer = nothing;
  const http = new Promise((resolve) => {
    answer = resolve;
  });
  const presser = createPresser(line, nothing, () => http);
  const carried = presser.press(null);
  const begun = performance.now();
  while (!line.sent.length && performance.now() - begun < 3000) {
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
  const waited = performance.now() - begun;
  answer(202);
  await carried;
  equal(line.sent.length, 1);
  equal(waited > 450, true);
});

test("a press is repeated under one id until the server has it", async () => {
  const line = fakeLine();
  const answers = [0, 503, 202];
  /** @type {string[]} */
  const ids = [];
  const presser = createPresser(line, nothing, async ({ pressId }) => {
    ids.push(pressId);
    return answers[ids.length - 1];
  });
  await presser.press("AGI");
  equal(ids.length, 3);
  equal(new Set(ids).size, 1);
});

test("13.12 a press that nobody took survives a reload and is sent as the same STOP", async () => {
  const kept = memory();
  const cut = createPresser(fakeLine(), nothing, () => new Promise(nothing), kept);
  cut.press("AGI");
  cut.press(null);
  /** @type {(string | null)[][]} */
  const sent = [];
  const again = createPresser(
    fakeLine(),
    nothing,
    async ({ robotId, pressId }) => {
      sent.push([robotId, pressId]);
      return 202;
    },
    kept,
  );
  again.goOn();
  await new Promise((resolve) => setTimeout(resolve, 20));
  equal(sent, [
    ["AGI", cut.pending("AGI")?.pressId ?? ""],
    [null, cut.pending(null)?.pressId ?? ""],
  ]);
  const later = createPresser(fakeLine(), nothing, async () => 202, kept);
  later.goOn();
  equal(later.pending("AGI"), null);
});

test("13.12 what was kept and cannot be read as a press is none", () => {
  for (const text of ["", "{", "{}", '[{"robotId":1}]', '[{"release":"AGI"}]']) {
    const kept = memory();
    kept.setItem("iveg_kept_stops", text);
    const presser = createPresser(fakeLine(), nothing, async () => 202, kept);
    presser.goOn();
    equal(presser.pending("AGI"), null);
  }
});
