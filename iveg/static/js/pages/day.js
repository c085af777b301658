/**
 * The evening sheet of the server, with times and lanes in the reader's language.
 */

import { laneName } from "../core/lanes.js";
import { all, setText } from "../panels/dom.js";
import { wallText } from "./history/local_time.js";

/** @param {import("../core/page.js").Page} page */
export function start({ i18n }) {
  function draw() {
    for (const time of all("[data-moment]")) {
      setText(time, timeOf(String(time.dataset.moment)));
    }
    for (const lane of all("[data-lane]")) {
      const label = String(lane.dataset.lane);
      setText(lane, label ? laneName(label, i18n.t) : i18n.t("day.no_lane"));
    }
  }
  i18n.onChange(draw);
  draw();
}

/** Time of day in Madrid. @param {string} at ISO-8601 */
function timeOf(at) {
  return wallText(Date.parse(at)).slice(11, 19);
}
