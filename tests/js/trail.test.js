import { createTrails, thinned } from "../../iveg/static/js/map/layers/trail.js";
import { equal, test } from "./harness.js";

test("a robot that stands leaves one crumb", () => {
  const trails = createTrails();
  for (let ms = 0; ms < 5000; ms += 100) trails.add("AGI", { x: 1, y: 1 }, ms);
  equal(trails.of("AGI").length, 1);
});

test("an hour of driving stays bounded and reaches back ten minutes", () => {
  const trails = createTrails();
  const hourMs = 3_600_000;
  for (let ms = 0; ms < hourMs; ms += 50) trails.add("AGI", { x: ms / 1000, y: 0 }, ms);
  const trail = trails.of("AGI");
  equal(trail.length <= 2064, true);
  const reachS = (hourMs - trail[0].atMs) / 1000;
  equal(reachS > 590 && reachS < 620, true);
});

test("old steps are coarse and new ones fine", () => {
  const trail = Array.from({ length: 1200 }, (_, i) => ({
    x: 0.1 * i,
    y: 0,
    atMs: 100 * i,
  }));
  const kept = thinned(trail, 120_000);
  const old = kept.filter(({ atMs }) => atMs < 60_000).length;
  equal(old < 130 && kept.length - old > 590, true);
});

test("a robot that left the fleet leaves no trail", () => {
  const trails = createTrails();
  trails.add("AGI", { x: 1, y: 1 }, 0);
  trails.keepOnly(new Map());
  equal(trails.of("AGI"), []);
});
