import { make } from "../../iveg/static/js/panels/dom.js";
import { createLogEach, entryOf } from "../../iveg/static/js/panels/log_each.js";
import { equal, test } from "./harness.js";

/** A row of `/api/v1/detections/latest`. @param {object} [changes] */
const row = (changes = {}) => ({
  ...{ at: "2026-01-01T10:00:00.123Z", robot_id: "AGI", class: "person" },
  ...{ class_id: "farmer", probability: 0.94, person_id: "P3-0a", ...changes },
});

/** @param {any} answer @param {{isStill?: boolean}} [how] */
async function pressed(answer, { isStill = false } = {}) {
  const button = make("button");
  button.id = "log-each";
  document.body.replaceChildren(button);
  /** @type {string[]} */
  const asked = [];
  const read = async (/** @type {string} */ path) => {
    asked.push(path);
    return answer;
  };
  const each = createLogEach({ read, isStill: () => isStill, onChange: () => {} });
  button.click();
  await Promise.resolve();
  await Promise.resolve();
  return { each, asked, button };
}

test("each detection tells its source, its class and its confidence", () => {
  const { at, robot_id, kind, key, slots } = entryOf(row(), 0);
  equal([at, robot_id, kind], ["2026-01-01T10:00:00.123Z", "AGI", "detection"]);
  equal(
    [key, slots.class, slots.class_id],
    ["log.detection_each_of", "person", "farmer"],
  );
  equal([slots.confidence, slots.person], [0.94, "P3-0a"]);
});

test("a detection that belongs to nobody names the detector's own word", () => {
  const { key, slots } = entryOf(
    row({ class: null, class_id: "box", person_id: null }),
    0,
  );
  equal([key, slots.class], ["log.detection_each", "box"]);
});

test("looks at one person that the log sums up are rows of their own, oldest first", async () => {
  const items = [row({ probability: 0.9 }), row({ probability: 0.8 })];
  const { each, asked, button } = await pressed({ status: 200, body: { items } });
  equal(
    each.entries([]).map(({ slots }) => slots.confidence),
    [0.8, 0.9],
  );
  equal(new Set(each.entries([]).map(({ id }) => id)).size, 2);
  equal(asked, ["detections/latest?limit=100"]);
  equal(button.getAttribute("aria-pressed"), "true");
  each.off();
  equal([each.isOn(), each.entries([]).length], [false, 0]);
});

test("an answer that could not be read says so and shows no old rows", async () => {
  const { each } = await pressed({ status: 503, body: null });
  equal([each.entries([]).length, each.empty()], [0, "logpanel.each_failed"]);
  each.off();
});

test("a list that is being read does not move", async () => {
  const { each, asked } = await pressed(
    { status: 200, body: { items: [] } },
    {
      isStill: true,
    },
  );
  equal(asked, []);
  each.off();
});
