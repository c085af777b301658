import {
  askedMoment,
  isUnread,
  pastAddress,
} from "../../iveg/static/js/core/moments.js";
import { equal, test } from "./harness.js";

test("a moment is an address, and an address without one is now", () => {
  const atS = Date.UTC(2026, 10, 24, 9, 42, 7) / 1000;
  const address = pastAddress(atS);

  equal(askedMoment(address.slice(1)), atS);
  equal(askedMoment(""), null);
  equal(isUnread(""), false);
  equal(isUnread(address.slice(1)), false);
  equal(askedMoment("?t=2026-11-24T10:42:07+01:00"), atS);
});

test("a moment that cannot be shown is told, not shown as live without a word", () => {
  const tomorrow = new Date(Date.now() + 90_000_000).toISOString();
  for (const asked of ["yesterday", "", "12", "2026-13-45T00:00Z", tomorrow]) {
    equal(askedMoment(`?t=${asked}`), null);
    equal(isUnread(`?t=${asked}`), true);
  }
});
