/**
 * The panel of the map's layers: switches, knowledge of one robot, trails, keys.
 */

import { TRAIL_SPANS_S } from "../map/layers/trail.js";
import { make, need } from "./dom.js";

/**
 * @param {import("../main.js").App} app
 * @param {import("./mapbox.js").LiveMap} map
 * @param {() => void} onBeliever
 */
export function drawLayers({ store, i18n }, map, onBeliever) {
  const switches = map.layers().map(({ name, on }) => {
    const [choice, input] = makeChoice("checkbox", i18n.t(`map.layer.${name}`), on);
    input.addEventListener("change", () => map.setLayer(name, input.checked));
    return choice;
  });
  const spans = TRAIL_SPANS_S.map((seconds) => {
    const said = i18n.t("map.trail_span", { seconds });
    const [choice, input] = makeChoice("radio", said, map.trailSeconds() === seconds);
    input.name = "trail";
    input.addEventListener("change", () => map.setTrail(seconds));
    return choice;
  });
  const [shortcuts, keys] = makeChoice(
    "checkbox",
    i18n.t("map.shortcuts"),
    map.hasShortcuts(),
  );
  keys.addEventListener("change", () => map.setShortcuts(keys.checked));
  const ids = [null, ...store.robots().keys()];
  const beliefs = ids.map((robot) => {
    const key = robot === null ? "map.belief_all" : "map.belief_one";
    const isOn = map.believer() === robot;
    const [choice, input] = makeChoice("radio", i18n.t(key, { robot }), isOn);
    input.name = "belief";
    input.addEventListener("change", () => {
      map.setBeliever(robot);
      onBeliever();
    });
    return choice;
  });
  need("#layers").replaceChildren(
    ...switches,
    make("h3", "choices__head", i18n.t("map.belief")),
    ...beliefs,
    make("h3", "choices__head", i18n.t("map.trail_length")),
    ...spans,
    make("h3", "choices__head", i18n.t("map.keyboard")),
    shortcuts,
  );
}

/**
 * @param {"checkbox" | "radio"} type
 * @param {string} text
 * @param {boolean} isOn
 * @returns {[HTMLLabelElement, HTMLInputElement]}
 */
function makeChoice(type, text, isOn) {
  const choice = make("label", "choice");
  const input = make("input");
  input.type = type;
  input.checked = isOn;
  choice.append(input, text);
  return [choice, input];
}
