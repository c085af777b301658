import { createPlaces, overlap } from "../../iveg/static/js/map/layers/places.js";
import { placesOfTags } from "../../iveg/static/js/map/layers/tags.js";
import { equal, test } from "./harness.js";

const LETTER_PX = 8;

/** Ten robots in two rows of an aisle each, 4 m apart: as small as a tablet shows them.
 * @param {Record<string, unknown>} state */
function frame(state) {
  const robots = Array.from({ length: 10 }, (_, n) => ({
    id: `R${n + 1}`,
    pose: { x: 2 + 4 * (n % 5), y: 15 - 5 * Math.floor(n / 5), yaw: 0 },
    length: 1,
    width: 0.6,
    replay: false,
    ageS: 0,
    link: "LIVE",
    situation: { level: "working", state: "clear", slots: {} },
    ...state,
  }));
  const paint =
    /** @type {import("../../iveg/static/js/map/layers/paint.js").Paint} */ (
      /** @type {unknown} */ ({
        ctx: {
          measureText: (/** @type {string} */ text) => ({
            width: text.length * LETTER_PX,
          }),
        },
        theme: { font: "mono", alert: [] },
        view: { scale: 13, x: 10, y: 10, width: 700, height: 300 },
        labels: { ago: () => "hace 4 s", age: () => "1,1 s" },
        places: createPlaces(),
        scene: { map: null, people: [], robots },
      })
    );
  return { paint, robots: paint.scene.robots };
}

/** What stands on what, of the labels of all robots.
 * @param {ReturnType<typeof frame>} told */
function covered({ paint, robots }) {
  const { view } = paint;
  const rects = placesOfTags(paint, robots).map(({ y, aside, tags }, n) => {
    const { id, pose } = robots[n];
    const x = view.width / 2 + (pose.x - view.x) * view.scale + aside;
    const middle = view.height / 2 - (pose.y - view.y) * view.scale + y;
    const half = (id.length * LETTER_PX) / 2;
    const right = tags.reduce((at, [text]) => at + text.length * LETTER_PX + 16, 2);
    return {
      left: x - half,
      right: x + half + right,
      top: middle - 7,
      bottom: middle + 7,
    };
  });
  const pairs = rects.flatMap((one, n) => rects.slice(n + 1).map((it) => [one, it]));
  return pairs.filter(([one, it]) => overlap(one, it)).length;
}

test("no robot's name or age stands on another's, however small the map", () => {
  const lost = { link: "LOST", ageS: 4 };
  const held = { situation: { level: "locked", state: "standing", slots: {} } };
  equal(
    [{}, lost, { link: "LATE", ageS: 1.1 }, held].map(frame).map(covered),
    [0, 0, 0, 0],
  );
});

test("an age stands beside the name where there is room", () => {
  const { paint, robots } = frame({ link: "LOST", ageS: 4 });
  const [place] = placesOfTags(paint, robots.slice(0, 1));
  equal(place.tags.length, 1);
});
