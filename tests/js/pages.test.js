import { judgeDataPath, ORDER } from "../../iveg/static/js/pages/health_sentence.js";
import { tookOf } from "../../iveg/static/js/pages/latency.js";
import { command } from "./builders.js";
import { equal, test } from "./harness.js";

/** @param {Record<string, "ok" | "late" | "down" | "unknown">} states */
const hops = (states) =>
  ORDER.map((hop) => ({ hop, state: states[hop] ?? /** @type {const} */ ("ok") }));

/** @param {string} id @param {import("../../iveg/static/js/core/clock.js").Link} link */
const heard = (id, link = "LIVE") => ({ id, link });
const LIVE = [heard("AGI"), heard("AGII")];
const LOST = heard("AGI", "LOST");

/** @param {Partial<import("../../iveg/static/js/core/protocol.js").Command>} [differs] */
const order = (differs = {}) =>
  command({
    command_id: "1",
    robot_id: "AGI",
    kind: "stop",
    state: "STANDING",
    requested_by: "Ana",
    tries: 1,
    standstill_ms: 412,
    times: {
      pressed: null,
      requested: "2026-11-20T12:00:00.000Z",
      sent: { fiware: "2026-11-20T12:00:00.004Z", direct: "2026-11-20T12:00:00.002Z" },
      answer: { fiware: "2026-11-20T12:00:00.050Z" },
      standing: "2026-11-20T12:00:00.412Z",
    },
    ...differs,
  });

test("of several broken hops the one nearest to the robots is named", () => {
  const found = judgeDataPath(
    hops({ notifications: "down", iot_agent: "down" }),
    LIVE,
    true,
  );
  equal(found.key, "health.hop.iot_agent.down");
  equal(found.hop, "iot_agent");
});

test("each transport is measured from the press on, and silence is no number", () => {
  equal(tookOf(order(), ["direct", "fiware", "dds"]), {
    accepted: null,
    sent: [2, 4, null],
    answer: [null, 50, null],
    standing: 412,
  });
});

test("13.5 a chain that nobody has heard of, or without robots, is not said to work", () => {
  equal(judgeDataPath([], [], true).key, "fleet.unknown");
  const silent = judgeDataPath(hops({}), [LOST, heard("AGII")], true);
  equal([silent.key, silent.slots.robots], ["fleet.silent_robots", "AGI"]);
  const none = judgeDataPath(hops({}), [], true);
  equal([none.key, none.state], ["fleet.no_robots", "unknown"]);
  const late = judgeDataPath(hops({}), [heard("AGI"), heard("AGII", "LATE")], true);
  equal(
    [late.key, late.state, late.slots.robots],
    ["fleet.late_robots", "late", "AGII"],
  );
});
