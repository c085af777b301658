import {
  dayAndTime,
  momentOf,
  offsetAt,
  typedText,
  wallText,
} from "../../iveg/static/js/pages/history/local_time.js";
import { equal, test } from "./harness.js";

const HOUR = 3_600_000;

test("the greenhouse is one hour ahead in winter and two in summer", () => {
  equal(offsetAt(Date.parse("2026-01-15T12:00:00Z")), HOUR);
  equal(offsetAt(Date.parse("2026-07-15T12:00:00Z")), 2 * HOUR);
});

test("a moment shows the clock on the greenhouse's wall", () => {
  equal(wallText(Date.parse("2026-07-15T22:30:00.250Z")), "2026-07-16T00:30:00.250");
});

test("what was typed names the moment that it shows", () => {
  for (const at of [
    "2026-01-15T12:00:00Z",
    "2026-07-15T23:59:59Z",
    "2026-03-29T00:59:59Z",
    "2026-03-29T01:00:00Z",
    "2026-10-25T00:30:00Z",
    "2026-10-25T02:00:00Z",
  ]) {
    const moment = Date.parse(at);
    equal(momentOf(wallText(moment).slice(0, 19)), moment);
  }
});

test("the hour that winter time repeats is taken as its first round", () => {
  equal(momentOf("2026-10-25T02:30:00"), Date.parse("2026-10-25T00:30:00Z"));
});

test("an hour that summer time skips is the hour after", () => {
  equal(momentOf("2026-03-29T02:30:00"), Date.parse("2026-03-29T01:30:00Z"));
});

test("people type a moment as it is shown to them, seconds at will", () => {
  const moment = Date.parse("2026-07-15T21:05:06Z");
  equal(typedText(moment), "2026-07-15 23:05:06");
  equal(momentOf(typedText(moment)), moment);
  equal(momentOf("  2026-07-15  23:05 "), moment - 6000);
});

test("what is no time is no moment", () => {
  equal(Number.isNaN(momentOf("")), true);
  equal(Number.isNaN(momentOf("20/11/2026 09:00")), true);
});

test("times for people have 24 hours and the greenhouse's clock", () => {
  equal(dayAndTime("2026-07-15T21:05:06.789Z"), "15/07 23:05:06");
  equal(
    dayAndTime(Date.parse("2026-12-31T23:30:00Z"), { withYear: true }),
    "01/01/2027 00:30:00",
  );
  equal(dayAndTime(null), "—");
});
