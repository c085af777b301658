/**
 * What is switched off on the map is said on the map: an empty one must not look calm.
 */

import { need, setHidden, setText } from "./dom.js";

/** Layers that show nothing of robots or people. */
const PLAIN = new Set(["costmap", "grid", "scalebar", "coverage"]);

/**
 * @param {readonly {name: string, on: boolean}[]} layers
 * @param {{t: (key: string, slots?: Record<string, string>) => string}} words
 * @returns {string} empty where nothing that matters is hidden
 */
export function hiddenSaid(layers, words) {
  const hidden = layers.filter(({ name, on }) => !on && !PLAIN.has(name));
  if (!hidden.length) return "";
  const names = hidden.map(({ name }) => words.t(`map.layer.${name}`).toLowerCase());
  return words.t("map.hidden", { layers: names.join(", ") });
}

/**
 * @param {Parameters<typeof hiddenSaid>[0]} layers
 * @param {Parameters<typeof hiddenSaid>[1]} words
 */
export function drawHidden(layers, words) {
  const said = hiddenSaid(layers, words);
  setHidden(need("#hidden-layers"), !said);
  setText(need("#hidden-layers"), said);
}
