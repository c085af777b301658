import { ticksOf } from "../../iveg/static/js/panels/timebar.js";
import { equal, near, test } from "./harness.js";

test("28.6: the strip of time tells full minutes where they are, and none at its ends", () => {
  const noon = Date.UTC(2026, 10, 20, 12) / 1000;
  const ticks = ticksOf(noon + 30);
  equal(
    ticks.map(({ at }) => (noon - at) / 60),
    [8, 6, 4, 2, 0],
  );
  near(ticks[4].share, 0.95);
  equal(
    ticksOf(noon + 10).map(({ at }) => (noon - at) / 60),
    [8, 6, 4, 2],
  );
});
