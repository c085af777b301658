/**
 * Names of lanes in the reader's language, for the names in iVeg's own greenhouse files;
 * a name that a grower chose stays as it is.
 */

/** Names of lanes in iVeg's greenhouse files, and the key of the message for each. */
const GIVEN = /** @type {const} */ ([
  [/^(?:Pasillo )?(\d+)$/, "number"],
  [/^Pasillo (\d+) norte$/, "number_north"],
  [/^Pasillo (\d+) sur$/, "number_south"],
  [/^Pasillo central$/, "central"],
  [/^Cabecera norte$/, "end_north"],
  [/^Cabecera sur$/, "end_south"],
]);

/** @typedef {(key: string, slots?: Record<string, string>) => string} Translate */

/** @param {string} label @param {Translate} t */
export const laneName = (label, t) => named("lane", label, t) ?? label;

/** Where somebody is: "in aisle 3". @param {string} label @param {Translate} t */
export const placeName = (label, t) =>
  named("place", label, t) ?? t("place.default", { label });

/** @param {string} block @param {string} label @param {Translate} t */
function named(block, label, t) {
  for (const [form, key] of GIVEN) {
    const found = form.exec(label);
    if (found) return t(`${block}.${key}`, { n: found[1] ?? "" });
  }
  return null;
}
