/** A small table of parameters, as the server writes it into the page.
 * @type {import("../../iveg/static/js/pages/parameters.js").Parameter[]} */
export const PARAMETERS = [
  {
    key: "confidence_threshold",
    class_key: "class_thresholds",
    unit: "share",
    protects: "less",
    word: "threshold",
  },
  {
    key: "radius_m",
    class_key: "class_radii_m",
    unit: "m",
    protects: "more",
    word: "radius",
  },
  {
    key: "foresight",
    class_key: null,
    unit: "switch",
    protects: "more",
    word: "foresight",
  },
  {
    key: "foresight_s",
    class_key: null,
    unit: "s",
    protects: "more",
    word: "foresight_s",
  },
];
