/**
 * Names hidden layers on the map: a map without them must not look calm.
 */

import { need, setHidden, setText } from "./dom.js";

/** Layers that show nothing of robots or people. */
const PLAIN = new Set(["costmap", "grid", "scalebar", "coverage"]);

/**
 * @param {readonly {name: string, on: boolean}[]} layers
 * @param {{t: (key: string, slots?: Record<string, string>) => string}} i18n
 * @returns {string} empty where nothing that matters is hidden
 */
export function hiddenSaid(layers, i18n) {
  const hidden = layers.filter(({ name, on }) => !on && !PLAIN.has(name));
  if (!hidden.length) return "";
  const names = hidden.map(({ name }) => i18n.t(`map.layer.${name}`).toLowerCase());
  return i18n.t("map.hidden", { layers: names.join(", ") });
}

/**
 * @param {Parameters<typeof hiddenSaid>[0]} layers
 * @param {Parameters<typeof hiddenSaid>[1]} i18n
 */
export function drawHidden(layers, i18n) {
  const said = hiddenSaid(layers, i18n);
  setHidden(need("#hidden-layers"), !said);
  setText(need("#hidden-layers"), said);
}
