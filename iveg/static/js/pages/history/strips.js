/**
 * A figure of strips, one below the other, as a figure for each: drawn one by one they
 * block the page no longer than one of them does, and each has room for its name.
 *
 * @typedef {import("./charts.js").Figure} Figure
 */

import { whenResting } from "../../core/rest.js";
import { all, make } from "../../panels/dom.js";

/** @param {Figure} figure @returns {Figure[]} from the top down */
export function stripsOf({ data, layout }) {
  const axes = Object.keys(layout).filter((key) => /^yaxis\d*$/.test(key));
  return axes.map((key, index) => {
    const axis = key.replace("axis", "");
    const isAbove = index < axes.length - 1;
    const { domain, ...yaxis } = layout[key];
    return {
      data: data.filter((trace) => trace.yaxis === axis).map(onFirstAxis),
      layout: {
        meta: { ...layout.meta, isAbove },
        showlegend: false,
        xaxis: { ...layout.xaxis, anchor: "y" },
        yaxis,
        shapes: shapesOn(axis, layout.shapes ?? []),
      },
    };
  });
}

/** @param {Figure["data"][number]} trace */
const onFirstAxis = ({ yaxis, ...trace }) => trace;

/** @param {string} axis @param {Record<string, any>[]} shapes */
function shapesOn(axis, shapes) {
  const mine = shapes.filter(({ yref }) => yref === `${axis} domain`);
  return mine.map((shape) => ({ ...shape, yref: "y domain" }));
}

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
