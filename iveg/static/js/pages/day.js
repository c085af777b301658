/**
 * The evening sheet: the server wrote it; here its times and aisles become the reader's.
 */

import { wallText } from "../history/madrid.js";
import { laneName } from "../lanes.js";
import { all, setText } from "../panels/dom.js";

/** @param {import("../page.js").Page} page */
export function start({ words }) {
  function draw() {
    for (const time of all("[data-moment]")) {
      setText(time, timeOf(String(time.dataset.moment)));
    }
    for (const lane of all("[data-lane]")) {
      const label = String(lane.dataset.lane);
      setText(lane, label ? laneName(label, words.t) : words.t("day.no_lane"));
    }
  }
  words.onChange(draw);
  draw();
}

/** Time of day in Madrid. @param {string} at ISO-8601 */
function timeOf(at) {
  return wallText(Date.parse(at)).slice(11, 19);
}
