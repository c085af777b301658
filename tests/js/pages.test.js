import { createI18n } from "../../iveg/static/js/core/i18n.js";
import { detailsSaid } from "../../iveg/static/js/pages/audit.js";
import { stepsOf } from "../../iveg/static/js/pages/command.js";
import {
  judgeDataPath,
  ORDER,
  sentenceOf,
} from "../../iveg/static/js/pages/health_sentence.js";
import {
  endSaid,
  statOf,
  summaryOf,
  tookOf,
} from "../../iveg/static/js/pages/latency.js";
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

test("a whole chain is said to work", () => {
  equal(judgeDataPath(hops({}), LIVE, true).key, "fleet.whole");
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

test("a hop that is down is worse news than a late one before it", () => {
  const found = judgeDataPath(hops({ mqtt: "late", orion: "down" }), LIVE, true);
  equal(found.hop, "orion");
});

test("an agent that falls behind is said to be late by its seconds", () => {
  const found = judgeDataPath(
    [{ hop: "iot_agent", state: "late", lag_s: 23.4, growing: true }],
    LIVE,
    true,
  );
  equal([found.key, found.slots.lag], ["health.lag.growing", 23.4]);
});

test("a lag that does not grow is said without it", () => {
  const hop = /** @type {const} */ ({ hop: "iot_agent", state: "late", lag_s: 23.4 });
  equal(sentenceOf(hop).key, "health.lag.steady");
});

test("what is late for another reason than its lag keeps its sentence", () => {
  const hop = /** @type {const} */ ({ hop: "iot_agent", state: "late", lag_s: 0.1 });
  equal(sentenceOf(hop).key, "health.hop.iot_agent.late");
});

test("a silent robot before a merely late chain is named with its id", () => {
  const found = judgeDataPath(
    hops({ mqtt: "late" }),
    [LOST, heard("AGII", "UNKNOWN")],
    true,
  );
  equal([found.key, found.slots.robots], ["fleet.silent_robots", "AGI, AGII"]);
});

test("a dead broker explains silent robots", () => {
  equal(judgeDataPath(hops({ mqtt: "down" }), [LOST], true).hop, "mqtt");
});

test("without the server nothing else is known", () => {
  equal(judgeDataPath(hops({}), LIVE, false).key, "fleet.silent_server");
});

test("each transport is measured from the press on, and silence is no number", () => {
  equal(tookOf(order(), ["direct", "fiware", "dds"]), {
    accepted: null,
    sent: [2, 4, null],
    answer: [null, 50, null],
    standing: 412,
  });
});

test("release and resume are left out of what a STOP takes", () => {
  const orders = [order(), order({ kind: "release", standstill_ms: 9000 })];
  const found = summaryOf(orders, ["fiware"]);
  equal([found.count, found.standing], [1, { median: 412, worst: 412 }]);
  equal(found.answer, [{ median: 50, worst: 50 }]);
});

test("a STOP that nobody confirmed is counted", () => {
  equal(summaryOf([order({ state: "RUNNING", was_loud: true })], []).unconfirmed, 1);
});

test("13.7: a STOP pressed while the server was dead has one zero: the press", () => {
  const { times } = order();
  const took = tookOf(
    order({
      times: { ...times, pressed: "2026-11-20T11:59:20.000Z" },
      standstill_ms: 40412,
    }),
    ["direct", "fiware"],
  );
  equal([took.accepted, took.sent[0], took.answer[1]], [40000, 40002, 40050]);
  equal(took.standing, 40412);
});

test("13.7: a refused resume reads refused, with the reason", () => {
  const words = {
    t: (/** @type {string} */ key, /** @type {any} */ slots) => `${key} ${slots?.why}`,
  };
  const resume = order({ kind: "resume", state: "READY", reason: "held" });
  const said = endSaid({ ...resume, outcome: "refused" }, /** @type {any} */ (words));
  equal(said, "commandspage.end.refused held");
});

test("the median is a number that was measured", () => {
  equal(statOf([30, 10, null, 20, 40]), { median: 30, worst: 40 });
  equal(statOf([null]), null);
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

test("28.6: the moments of an order stand in time from the press; one that is missing, last", () => {
  const words = /** @type {any} */ ({
    t: (/** @type {string} */ key, /** @type {any} */ slots) =>
      slots ? String(slots.ms) : key.split(".").pop(),
  });
  const steps = stepsOf(order(), ["direct", "fiware"], words);
  equal(
    steps.map(({ name, took, verdict }) => `${name} ${took} ${verdict}`),
    [
      "accepted 0 ok",
      "sent_direct 2 ok",
      "sent_fiware 4 ok",
      "fiware 50 ok",
      "standing 412 ok",
      "direct  missing",
    ],
  );
  const release = stepsOf(order({ kind: "release" }), ["direct"], words);
  equal(
    release.map(({ name }) => name),
    ["accepted", "sent_direct"],
  );
});

test("a row of the audit tells its details in the reader's words", async () => {
  const i18n = createI18n(async () => ({
    auditpage: {
      detail: {
        ends_at: "hasta",
        role: "rol:",
        holder: "por",
        status: "rechazado con",
      },
    },
    header: { role: { viewer: "solo ver" } },
  }));
  await i18n.use("es");
  const details = { ends_at: 1796249745.05, role: "viewer", scope: null, odd: 3 };

  equal(detailsSaid(details, i18n), "hasta 02/12 23:15:45 · rol: solo ver · odd 3");
  equal(detailsSaid({ ends_at: null }, i18n), "—");
  equal(detailsSaid({ status: 200, holder: "Eva" }, i18n), "por Eva");
  equal(detailsSaid({ person_id: "01J", holder: "Eva" }, i18n), "por Eva");
  equal(detailsSaid({ person_id: "01J" }, i18n), "person_id 01J");
  equal(detailsSaid({ status: 409 }, i18n), "rechazado con 409");
});
