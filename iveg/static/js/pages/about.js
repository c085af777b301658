/**
 * The page about iVeg, with the numbers of the rule in force.
 */

import { translate } from "../core/i18n.js";
import { need } from "../panels/dom.js";

/** @param {import("../core/page.js").Page} page */
export function start({ store, i18n }) {
  const place = need("#about-rule");
  const sentence = need("span", place);

  function draw() {
    /** @type {import("../core/protocol.js").Rule | null | undefined} */
    const rule = store.get("rule");
    if (!rule) return;
    const { confidence_threshold, class_thresholds, radius_m, class_radii_m } = rule;
    const slots = {
      threshold: class_thresholds?.person ?? confidence_threshold,
      radius: class_radii_m?.person ?? radius_m,
      robot_radius: class_radii_m?.robot ?? radius_m,
    };
    sentence.dataset.slots = JSON.stringify(slots);
    translate(place, i18n.t);
  }

  store.subscribe("rule", draw);
  draw();
}
