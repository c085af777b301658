import { Store } from "../../iveg/static/js/core/store.js";
import { make } from "../../iveg/static/js/panels/dom.js";
import { createLogPanel } from "../../iveg/static/js/panels/log.js";
import { rowsOf } from "../../iveg/static/js/panels/log_rows.js";
import { equal, test } from "./harness.js";

const i18n = {
  t: (/** @type {string} */ key) => key,
  onChange: () => {},
};

/** @param {() => boolean} isSo */
async function until(isSo) {
  for (let tries = 0; !isSo() && tries < 100; tries += 1)
    await new Promise((done) => setTimeout(done, 20));
}

/** @typedef {import("../../iveg/static/js/core/protocol.js").Entry} Entry */

/** @param {number} atS @param {string} key @param {object} [changes] */
function entry(atS, key, changes = {}) {
  const at = new Date(1_700_000_000_000 + 1000 * atS).toISOString();
  const kind = key.startsWith("log.speed") ? "speed" : "command";
  const slots = { robot: "AGI", factor: 0.5, cause: "P3" };
  return /** @type {Entry} */ ({
    ...{ id: atS, at, kind, robot_id: "AGI", key, slots },
    ...{ class: null, decision_id: null },
    ...changes,
  });
}
const DOWN = "log.speed_down.person";
const UP = "log.speed_up";
/** @param {Entry[]} entries */
const told = (...entries) =>
  rowsOf(entries).map(({ entry: { id }, lastedS }) => [id, lastedS]);

test("a slow-down that is over within a second is one row that says how long", () => {
  equal(told(entry(0, DOWN), entry(0.4, UP)), [[0, 0.4]]);
});

test("changes that last a second or more have rows of their own", () => {
  const two = [
    [0, null],
    [1, null],
  ];
  equal(told(entry(0, DOWN), entry(1, UP)), two);
});

test("a slow-down that comes back within a second goes on as the row that it was", () => {
  equal(told(entry(0, DOWN), entry(5, UP), entry(5.3, DOWN)), [[0, null]]);
  const flicker = [entry(0, DOWN), entry(0.3, UP), entry(0.6, DOWN), entry(0.9, UP)];
  equal(told(...flicker), [[0, 0.9]]);
});

test("a robot that is slow at the end is never told as back to full speed", () => {
  equal(told(entry(0, DOWN), entry(0.3, UP), entry(0.6, DOWN)), [[0, null]]);
});

test("another reason, another robot or another kind is never joined", () => {
  const other = { slots: { robot: "AGI", factor: 0.5, cause: "P9" } };
  equal(told(entry(0, DOWN), entry(0.3, UP), entry(0.6, DOWN, other)), [
    [0, 0.3],
    [0.6, null],
  ]);
  equal(told(entry(0, DOWN), entry(0.3, UP, { robot_id: "AGII" })).length, 2);
  equal(told(entry(0, DOWN), entry(0.2, "log.stop.sent"), entry(0.4, UP)), [
    [0, 0.4],
    [0.2, null],
  ]);
});

test("a row is completed in place: what has the focus keeps it", async () => {
  const places = ["log", "log-empty", "log-clear", "log-chips", "log-each"].map(
    (id) => {
      const place = make("div");
      place.id = id;
      return place;
    },
  );
  document.body.replaceChildren(...places);
  const store = new Store();
  createLogPanel(/** @type {any} */ ({ store, i18n }), { open: () => {} });
  store.apply("log", entry(1, DOWN, { decision_id: "d" }));
  await until(() => places[0].querySelector(".log__open") !== null);
  const opener = /** @type {HTMLElement} */ (places[0].querySelector(".log__open"));
  opener.focus();
  store.apply("log", entry(1.5, UP));
  await until(() => opener.textContent?.includes("log.lasted") === true);
  equal(opener.querySelector("time")?.textContent, "23:13:21.000");
  equal(document.activeElement === opener, true);
  equal(places[0].children.length, 1);
});
