/**
 * Names of lanes in the reader's words, where they are those that greenhouses of iVeg
 * come with; a name that a grower gave is a name, and stays as it is.
 */

/** What the greenhouse files of iVeg call their lanes, and the sentence for it. */
const GIVEN = /** @type {const} */ ([
  [/^(?:Pasillo )?(\d+)$/, "lane.number"],
  [/^Pasillo (\d+) norte$/, "lane.number_north"],
  [/^Pasillo (\d+) sur$/, "lane.number_south"],
  [/^Pasillo central$/, "lane.central"],
  [/^Cabecera norte$/, "lane.end_north"],
  [/^Cabecera sur$/, "lane.end_south"],
]);

/**
 * @param {string} label
 * @param {(key: string, slots?: Record<string, string>) => string} t
 */
export function laneName(label, t) {
  for (const [form, key] of GIVEN) {
    const found = form.exec(label);
    if (found) return t(key, { n: found[1] ?? "" });
  }
  return label;
}
