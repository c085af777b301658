import { drawMultiples, mostOf } from "../../iveg/static/js/pages/hop_multiples.js";
import { equal, test } from "./harness.js";

const none = { mean_ms: null, p95_ms: null };
const row = /** @type {any} */ ({
  data: "odometry",
  hops: {
    uplink: { mean_ms: 5, p95_ms: 10 },
    fiware: none,
    iveg: { mean_ms: 2, p95_ms: 20 },
    screen: { mean_ms: 1, p95_ms: 4 },
  },
});
const words = /** @type {any} */ ({ t: (/** @type {string} */ key) => key });

test("28.6: all hops are drawn on one scale, and an unmeasured one says so", () => {
  equal(mostOf([row]), 20);
  const place = document.createElement("div");
  drawMultiples(place, [row], words);
  const widths = [...place.querySelectorAll("rect")].map((bar) =>
    Number(bar.getAttribute("width")),
  );
  equal(widths, [50, 25, 100, 10, 20, 5]);
  equal(place.querySelectorAll("dd")[1].textContent, "—");
  drawMultiples(
    place,
    [{ ...row, hops: { ...row.hops, uplink: none, iveg: none, screen: none } }],
    words,
  );
  equal([mostOf([]), place.querySelectorAll("rect").length], [0, 0]);
});
