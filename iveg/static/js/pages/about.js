/**
 * The page about iVeg: what it says of the rule is what is in force now.
 */

import { translate } from "../i18n.js";
import { need } from "../panels/dom.js";

/** @param {import("../page.js").Page} page */
export function start({ store, words }) {
  const place = need("#about-rule");
  const sentence = need("span", place);

  function draw() {
    /** @type {import("../protocol.js").Rule | null | undefined} */
    const rule = store.get("rule");
    if (!rule) return;
    const slots = { threshold: rule.confidence_threshold, radius: rule.radius_m };
    sentence.dataset.slots = JSON.stringify(slots);
    translate(place, words.t);
  }

  store.subscribe("rule", draw);
  draw();
}
