import { barLength } from "../../iveg/static/js/map/layers/scalebar.js";
import * as viewport from "../../iveg/static/js/map/viewport.js";
import { equal, near, test } from "./harness.js";

const view = { ...viewport.createViewport(800, 600), x: 3, y: -2, scale: 37 };

test("a pixel and its world point are each other's inverse", () => {
  near(viewport.worldX(view, viewport.screenX(view, 5.25)), 5.25);
  near(viewport.worldY(view, viewport.screenY(view, -7.5)), -7.5);
});

test("y grows upwards in the world and downwards on the screen", () => {
  equal(viewport.screenY(view, 1) < viewport.screenY(view, 0), true);
});

test("zooming keeps the world point under the cursor", () => {
  const closer = viewport.zoomAt(view, 120, 510, 1.7);
  near(closer.scale, 37 * 1.7);
  near(viewport.worldX(closer, 120), viewport.worldX(view, 120));
  near(viewport.worldY(closer, 510), viewport.worldY(view, 510));
});

test("a zoom at its limit does not drift", () => {
  const close = viewport.zoomAt(view, 10, 10, 1e9);
  near(close.scale, viewport.MAX_SCALE);
  equal(viewport.zoomAt(close, 700, 20, 3), close);
  near(viewport.zoomAt(view, 10, 10, 1e-9).scale, viewport.MIN_SCALE);
});

test("panning moves the world with the finger", () => {
  const moved = viewport.panBy(view, 50, -30);
  near(viewport.screenX(moved, 1), viewport.screenX(view, 1) + 50);
  near(viewport.screenY(moved, 1), viewport.screenY(view, 1) - 30);
});

test("a fitted greenhouse is whole, centred and as large as fits", () => {
  const box = { xmin: -10, ymin: 0, xmax: 30, ymax: 10 };
  const fitted = viewport.fitTo(view, box, 20);
  const seen = viewport.visible(fitted);
  equal(seen.xmin <= box.xmin && seen.xmax >= box.xmax, true);
  equal(seen.ymin <= box.ymin && seen.ymax >= box.ymax, true);
  near(fitted.scale, 760 / 40);
  near(fitted.x, 10);
});

const PHONE = { ...viewport.createViewport(390, 430) };
const TOOLS = { left: 334, top: 10, right: 380, bottom: 234 };
const CHIPS = { left: 10, top: 10, right: 310, bottom: 74 };
const BAR = { left: 0, top: 392, right: 146, bottom: 430 };
const GREENHOUSE = { xmin: 0, ymin: 0, xmax: 20, ymax: 20 };

/** @param {viewport.Viewport} fitted where the greenhouse is (px) */
const placeOf = (fitted) => ({
  left: viewport.screenX(fitted, GREENHOUSE.xmin),
  top: viewport.screenY(fitted, GREENHOUSE.ymax),
  right: viewport.screenX(fitted, GREENHOUSE.xmax),
  bottom: viewport.screenY(fitted, GREENHOUSE.ymin),
});

/** @param {viewport.Rect} a @param {viewport.Rect} b */
const meet = (a, b) =>
  a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;

test("nothing that lies over the map lies over a fitted house", () => {
  const covers = [TOOLS, CHIPS, BAR];
  const place = placeOf(viewport.fitTo(PHONE, GREENHOUSE, 28, covers));
  equal(
    covers.map((cover) => meet(place, cover)),
    [false, false, false],
  );
  equal(place.left >= 0 && place.bottom <= PHONE.height, true);
});

test("without what lies over the map the tools would cover the house", () => {
  equal(meet(placeOf(viewport.fitTo(PHONE, GREENHOUSE, 28)), TOOLS), true);
});

test("a cover in a corner is passed where the greenhouse stays larger", () => {
  const wide = { ...PHONE, width: 1000 };
  const fitted = viewport.fitTo(wide, GREENHOUSE, 28, [BAR]);
  near(fitted.scale, (430 - 56) / 20);
  equal(placeOf(fitted).left > BAR.right, true);
});

test("a cover that leaves too little room is looked through", () => {
  const all = { left: 0, top: 0, right: 390, bottom: 430 };
  const fitted = viewport.fitTo(PHONE, GREENHOUSE, 28, [all, TOOLS]);
  equal(fitted, viewport.fitTo(PHONE, GREENHOUSE, 28, [TOOLS]));
});

test("bounds leave out what is no number, and nothing has no bounds", () => {
  const points = [
    { x: 1, y: 2 },
    { x: Number.NaN, y: 9 },
    { x: -3, y: 5 },
  ];
  equal(viewport.boundsOf(points, 1), { xmin: -4, xmax: 2, ymin: 1, ymax: 6 });
  equal(viewport.boundsOf([]), null);
});

test("the scale bar is a round length that fits", () => {
  equal([2, 20, 37, 400].map(barLength), [50, 5, 2, 0.2]);
});
