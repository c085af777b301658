/**
 * The small sensors of robots; written by `python -m iveg.models.typescript` from
 * `iveg/domain/kinds.py`.  `shown` is the quantity on the card, a true flag words it.
 */

export const SENSORS = /** @type {const} */ ([
  {
    name: "battery",
    shown: "percentage",
    flags: ["charging"],
  },
]);
