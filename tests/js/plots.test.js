import {
  distancesOf,
  lateSpansOf,
  limitsOf,
  marginsOf,
  ringsOf,
  spanOf,
} from "../../iveg/static/js/panels/past.js";
import { makePlot, pathOf, rangeOf } from "../../iveg/static/js/panels/plot.js";
import {
  barsOf,
  delaysOf,
  gapsOf,
  makeTimeline,
} from "../../iveg/static/js/panels/timeline.js";
import { equal, near, test } from "./harness.js";

const T0 = Date.parse("2026-11-20T12:00:00.000Z");
/** @param {number} s */
const at = (s) => new Date(T0 + 1000 * s).toISOString();
/** @param {number} s @param {number} x */
const pose = (s, x) => ({
  ...{ at: at(s), x, y: 0, linear: 0.8, limit_factor: 0.5 },
  margin_m: x === 1 ? null : x - 2,
});
/** @param {number} s @param {number | null} x */
const seen = (s, x) => ({ at: at(s), x, y: x === null ? null : 0 });
/** @param {Partial<import("../../iveg/static/js/panels/past.js").Past>} differs */
const past = (differs) => ({
  span: { since: T0, until: T0 + 4000 },
  poses: [pose(0, 0), pose(1, 1), pose(4, 4)],
  sightings: [],
  fastest: 0.8,
  ...differs,
});
const place = (/** @type {{at: number, value: number}} */ one) =>
  /** @type {[number, number]} */ ([one.at, one.value]);

test("13.13: each step tells how long it took after the one before", () => {
  const links = [0.1, 0.1, null, 0.35, 0.33].map((s) => ({ at: s && at(s) }));
  equal(delaysOf(links), [null, 0, null, 250, -20]);
});

test("28.6: each bar reaches from the moment before to its own, on one scale", () => {
  const bars = barsOf([0, 1, null, 4, 3].map((s) => ({ at: s === null ? s : at(s) })));
  equal(bars, [
    { from: 0, to: 0 },
    { from: 0, to: 25 },
    null,
    { from: 25, to: 100 },
    { from: 75, to: 100 },
  ]);
});

test("28.6: a wait of minutes is a gap, and the first moments stay apart", () => {
  const steps = [0, 0.1, 0.4, 143.4, 144].map((s) => ({ at: at(s) }));
  const bars = barsOf(steps).map((bar) => Math.round(bar?.to ?? -1));
  equal(bars, [0, 9, 35, 48, 100]);
  const [gap, ...others] = gapsOf(steps);
  equal([gap.waitMs, Date.parse(at(143.4)), others], [143_000, gap.at, []]);
  const said = (/** @type {string} */ key, /** @type {any} */ slots) =>
    `${key} ${slots.seconds}`;
  const whole = steps.map((step) => {
    return { ...step, name: "", verdict: "ok", state: "", took: "", said: "" };
  });
  const rows = [...makeTimeline(whole, /** @type {any} */ ({ t: said })).children];
  equal(
    rows.map((row) => row.querySelectorAll(".chain__slit").length),
    [3, 3, 3, 3, 3],
  );
  equal(
    rows.map((row) => row.textContent?.includes("record.gap 143")),
    [false, false, false, true, false],
  );
});

test("28.6: what took seconds, or as long as the rest, is drawn to scale", () => {
  const moments = [[0, 0.1, 4.9], [0, 2, 20], [0, 143], [7]];
  equal(
    moments.map((all) => gapsOf(all.map((s) => ({ at: at(s) }))).length),
    [0, 0, 0, 0],
  );
});

test("28.6: a distance is told between two poses, and nowhere else", () => {
  const sightings = [seen(-1, 3), seen(0.5, 3), seen(0.6, null), seen(2.5, 3)];
  const values = distancesOf(past({ sightings })).map(({ value }) => value);
  equal(values, [null, 2.5, null, null]);
});

test("28.6: the zone is that of somebody just seen, and grows while nobody looks", () => {
  const rings = ringsOf(past({ sightings: [seen(0, 3), seen(3, 3)] }), 2);
  const radius = (/** @type {number} */ s) =>
    rings.find((one) => one.at === T0 + 1000 * s)?.value ?? Number.NaN;
  near(radius(0), 2);
  equal(radius(2.75) > 5, true);
  near(radius(3), 2);
  equal(ringsOf(past({}), 2), []);
});

test("28.6: a limit in m/s is told where the robot's greatest speed is known", () => {
  equal(limitsOf(past({}))[0].value, 0.4);
  equal(limitsOf(past({ fastest: null })), []);
});

test("28.6: a margin that was not known breaks its line", () => {
  const samples = marginsOf(past({})).map((one) => ({ ...one, at: one.at - T0 }));
  const line = { kind: "", name: "", samples, gapMs: 9000 };
  equal(pathOf(line, place), "M0 -2h0M4000 2h0");
});

test("what came after a gap is framed in each plot, and named beside it", () => {
  const poses = [0, 0.5, 1, 3, 3.5, 9].map((s) => ({ ...pose(s, s), late: s > 0.2 }));
  const spans = lateSpansOf(past({ poses }));
  const told = spans.map(({ since, until }) => [since - T0, until - T0]);
  equal(told, [
    [500, 1000],
    [3000, 3500],
    [9000, 9000],
  ]);

  const i18n = /** @type {any} */ ({ number: String, time: String, t: String });
  const lines = [{ kind: "speed", name: "speed", samples: [{ at: T0, value: 1 }] }];
  const late = spans.map((one) => ({ ...one, name: "came late" }));
  const drawn = { title: "", says: "", span: { since: T0, until: T0 + 10_000 }, lines };
  const plot = makePlot({ ...drawn, late }, i18n);
  equal(plot?.querySelectorAll(".plot__late").length, 3);
  equal(plot?.querySelector('[data-kind="late"]')?.textContent, "came late");
});

test("28.6: of what goes on for long the beginning is told, with what was before", () => {
  equal(spanOf(at(0), at(10)), { since: T0 - 3000, until: T0 + 13_000 });
  equal(spanOf(at(0), at(600)).until, T0 + 63_000);
});

test("28.6: a line breaks where nothing was heard, and steps where it is a limit", () => {
  const samples = [0, 1, 9, null, 10].map((t, i) => ({
    at: 1000 * (t ?? 9.5),
    value: t === null ? null : i,
  }));
  const line = { kind: "", name: "", samples };
  equal(pathOf(line, place), "M0 0h0L1000 1M9000 2h0M10000 4h0");
  equal(pathOf({ ...line, isStep: true }, place), "M0 0h0H1000V1M9000 2h0M10000 4h0");
});

test("28.6: a scale holds zero and all values; without any there is no plot", () => {
  const line = (/** @type {number[]} */ ...values) => ({
    ...{ kind: "a", name: "a" },
    samples: values.map((value) => ({ at: 0, value })),
  });
  equal(rangeOf([line(0.3, 0.8)]), { top: 1, bottom: 0 });
  equal(rangeOf([line(-2.6, 1.2)]), { top: 2, bottom: -3 });
  equal(rangeOf([line()]), null);
  const plot = { title: "", says: "", span: { since: 0, until: 1 }, lines: [line()] };
  equal(makePlot(plot, /** @type {any} */ ({})), null);
});

test("a line without any value has no key", () => {
  const i18n = /** @type {any} */ ({ number: String, time: String, t: String });
  const lines = [
    { kind: "speed", name: "measured", samples: [{ at: 0, value: 0.8 }] },
    { kind: "limit", name: "limit", samples: [] },
    { kind: "ring", name: "zone", samples: [{ at: 0, value: null }] },
  ];
  const plot = makePlot(
    { title: "", says: "", span: { since: 0, until: 1 }, lines },
    i18n,
  );
  const keys = [...(plot?.querySelectorAll(".plot__key") ?? [])];
  equal(
    keys.map((key) => key.textContent),
    ["measured"],
  );
});
