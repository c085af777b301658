import { ageOf, createServerClock, linkOf } from "../../iveg/static/js/core/clock.js";
import { equal, near, test } from "./harness.js";

test("a value that was never heard is infinitely old and its link unknown", () => {
  equal(linkOf(ageOf({ age_s: null, receivedAtMs: 0 }, 0)), "UNKNOWN");
  equal(linkOf(ageOf(undefined, 0)), "UNKNOWN");
});

test("silence alone makes a robot late after one second and lost after three", () => {
  const robot = { age_s: 0, receivedAtMs: 0 };
  const links = [1000, 1001, 3000, 3001].map((ms) => linkOf(ageOf(robot, ms)));
  equal(links, ["LIVE", "LATE", "LATE", "LOST"]);
});

test("the server's clock is read from the quickest of the last answers", () => {
  const clock = createServerClock(0);
  clock.note(0, 400, 1000.9);
  clock.note(1000, 1020, 1001.01);
  clock.note(2000, 2800, 1003);
  near(clock.serverNow(3000), 1003, 1e-6);
  equal(clock.roundTripMs(), 800);
});

test("a moment here is told on the server's clock, with how wrong that may be", () => {
  const clock = createServerClock(0);
  equal(clock.serverOf(1000), null);
  clock.note(1000, 1040, 1_700_000_000, 500);
  clock.note(2000, 2010, 1_700_000_001, 501);
  const { at, within } = clock.serverOf(2505) ?? { at: 0, within: 0 };
  near(at, 501.5);
  near(within, 0.005);
});
