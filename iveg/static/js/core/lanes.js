/**
 * Names of lanes in the reader's language, for the names in iVeg's own greenhouse files;
 * a name that a grower chose stays as it is.
 */

/** Names of lanes in iVeg's greenhouse files, and the key of the message for each. */
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
