/**
 * What can hold for a robot, in the order in which it is told, and how grave it is;
 * written by `python -m iveg.models.typescript` from `iveg/domain/situation.py`.
 */

export const ORDER = /** @type {const} */ ({
  disobeys: "danger",
  lost_moving: "danger",
  stop_failed: "danger",
  stop_unknown: "doubt",
  stop_under_way: "caution",
  moved: "danger",
  another_iveg: "danger",
  recording_live: "danger",
  contradiction: "doubt",
  blind: "doubt",
  lost: "doubt",
  person: "caution",
  laser: "caution",
  robot: "caution",
  unsure: "doubt",
  locked: "locked",
  battery: "working",
  working: "working",
  away: "away",
});
