import { stripsOf } from "../../iveg/static/js/pages/history/strips.js";
import { equal, test } from "./harness.js";

/** @param {string} yaxis */
const trace = (yaxis) => ({
  ...{ type: "scatter", name: yaxis, x: [0], y: [1] },
  ...{ meta: { kind: "speed" }, yaxis },
});
const figure = {
  data: [trace("y"), trace("y2"), trace("y2")],
  layout: {
    meta: { x: "time", y: "speed" },
    xaxis: { type: "date", anchor: "y2" },
    yaxis: { domain: [0.5, 1], title: { text: "AGI (m/s)" } },
    yaxis2: { domain: [0, 0.4], title: { text: "AGII (m/s)" } },
    shapes: [{ name: "slow", x0: 1, x1: 2, yref: "y2 domain", y0: 0, y1: 1 }],
  },
};

test("each robot's strip is a figure of its own with its lines, name and times", () => {
  const [one, other] = stripsOf(figure);
  equal([one.data.length, other.data.length], [1, 2]);
  equal(one.layout.yaxis, { title: { text: "AGI (m/s)" } });
  equal(other.layout.xaxis, { type: "date", anchor: "y" });
  equal(one.layout.shapes, []);
  equal(other.layout.shapes, [{ ...figure.layout.shapes[0], yref: "y domain" }]);
  equal("yaxis" in other.data[0], false);
});

test("only the lowest strip says the time, as all have the same", () => {
  const above = stripsOf(figure).map(({ layout }) => layout.meta.isAbove);
  equal(above, [true, false]);
});
