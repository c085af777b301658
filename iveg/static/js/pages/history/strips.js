/**
 * Strips of a chart, one below the other: a figure for each, drawn one by one, blocks the
 * page no longer than one of them does, and each has room for its name.
 */

import { whenResting } from "../../core/rest.js";
import { all, make } from "../../panels/dom.js";

/**
 * One place for each strip.
 *
 * @param {HTMLElement} parent @param {number} count
 */
export function placesIn(parent, count) {
  const places = all(".strip", parent);
  for (const place of places.slice(count)) place.remove();
  while (places.length < count) {
    const place = make("div", "strip chart__place");
    places.push(place);
    parent.append(place);
  }
  return places.slice(0, count);
}

/**
 * Shows the same time in all strips when somebody looks closer at one.
 *
 * @param {any} plotly @param {any[]} places drawn
 */
export function keepInStep(plotly, places) {
  let isFollowing = false;
  for (const place of places) {
    place.removeAllListeners("plotly_relayout");
    place.on("plotly_relayout", async () => {
      if (isFollowing) return;
      isFollowing = true;
      const range = [...place.layout.xaxis.range];
      for (const other of places.filter((one) => one !== place)) {
        await whenResting();
        await plotly.relayout(other, { "xaxis.range": [...range] });
      }
      isFollowing = false;
    });
  }
}
