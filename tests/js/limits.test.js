import { LIMITS, zoneRadius } from "../../iveg/static/js/core/limits.js";
import { equal, near, test } from "./harness.js";

const RINGS = await (await fetch("/tests/data/rings.json")).json();

test("the zone's law gives the cases that the server's gives", () => {
  equal(RINGS.length > 50, true);
  for (const { radius_m, age_s, ring_m } of RINGS)
    near(zoneRadius(radius_m, age_s), ring_m, 1e-6);
});

test("a zone that goes on growing here ends where the server's would", () => {
  const atTwo = zoneRadius(2, 2);

  near(zoneRadius(atTwo, 2.5, 2), zoneRadius(2, 2.5));
});

test("a zone never shrinks, even if an age runs backwards", () => {
  near(zoneRadius(4, 1, 3), 4);
});

test("the page knows the server's numbers", () => {
  equal([LIMITS.live_s, LIMITS.late_s, LIMITS.zone_lasts_s], [1, 3, 10]);
});
