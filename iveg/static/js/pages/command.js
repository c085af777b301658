/**
 * The page of one order: how it ended, its moments on one scale of time, and the
 * robot's speed meanwhile.
 */

import { readApi } from "../core/api.js";
import { make, need } from "../panels/dom.js";
import { createNotes } from "../panels/notes.js";
import { readPast, spanOf } from "../panels/past.js";
import { makePastLink } from "../panels/past_link.js";
import { makePlots } from "../panels/record_plots.js";
import { makeShare } from "../panels/share.js";
import { makeTimeline } from "../panels/timeline.js";
import { makeSteps, orderSaid } from "./commands.js";
import { dayAndTime, millisecondsOf } from "./history/local_time.js";
import { endSaid, zeroOf } from "./latency.js";
import { soon, transportsOfPage } from "./rows.js";

/**
 * @typedef {import("../core/i18n.js").I18n} I18n
 * @typedef {import("./latency.js").Order} Order
 */

/** @param {import("../core/page.js").Page} page */
export function start({ store, i18n }) {
  const place = need("#command-record");
  const id = String(need("#command-page").dataset.command);
  const transports = transportsOfPage();
  /** @type {Order | null} */
  let order = null;
  /** @type {import("../panels/past.js").Past | null} */
  let past = null;
  /** @type {ReturnType<typeof createNotes> | null} */
  let notes = null;
  let status = 0;
  /** @type {Set<string>} */
  const opened = new Set([id]);

  async function load() {
    const answer = await readApi(`commands/${encodeURIComponent(id)}`);
    status = answer.status;
    if (status === 200) {
      past = await pastOf(answer.body);
      order = answer.body;
      if (!notes) {
        notes = createNotes(pinOf(answer.body), i18n);
        // Beside what is drawn anew, so that a note that is being written stays.
        place.after(notes.element);
        notes.element.open = true;
      }
    }
    place.setAttribute("aria-busy", "false");
    draw();
  }

  function draw() {
    const failed = i18n.t(status ? "rows.failed" : "rows.offline", { status });
    if (!order) return place.replaceChildren(make("p", "empty", failed));
    const plots = past && makePlots(past, aboutOf(order, i18n), i18n);
    place.replaceChildren(
      make("p", "decision__sentence", sentenceOf(order, i18n)),
      make("small", "", askedSaid(order, i18n)),
      ...(plots ? [plots] : []),
      makeTimeline(stepsOf(order, transports, i18n), i18n),
      ...makeSteps(order, i18n, opened),
      makePastLink(zeroOf(order.times), i18n),
      make("small", "", `${i18n.t("decision.id")} ${id}`),
      makeShare(`/commands/${encodeURIComponent(id)}`, i18n.t("record.link_to"), i18n),
    );
  }

  const again = soon(load);
  store.subscribe("commands/", (told) => {
    if (told.command_id === id) again();
  });
  store.subscribe("snapshot", again);
  i18n.onChange(() => {
    notes?.draw();
    draw();
  });
  load();
}

/** What a note about it is pinned to. @param {Order} order */
const pinOf = ({ robot_id, times }) => ({ at: zeroOf(times), robot_id });

/** @param {Order} order */
function pastOf({ robot_id, times }) {
  return readPast(spanOf(zeroOf(times), times.standing), robot_id, null);
}

/** @param {Order} order @param {I18n} i18n */
function sentenceOf(order, i18n) {
  const zero = zeroOf(order.times);
  const day = dayAndTime(zero, { withYear: true }).split(" ")[0];
  return i18n.t("commandspage.sentence", {
    at: `${day} ${millisecondsOf(zero)}`,
    order: orderSaid(order, i18n),
    robot: order.robot_id,
    end: endSaid(order, i18n),
  });
}

/** @param {Order} order @param {I18n} i18n */
const askedSaid = ({ requested_by, tries }, i18n) =>
  i18n.t("commandspage.asked", { by: requested_by, tries });

/** From the press until it stood, or to the end of the plot. @param {Order} order
 * @param {I18n} i18n */
function aboutOf({ times, standstill_ms }, i18n) {
  const { standing } = times;
  return {
    shade: {
      since: Date.parse(zeroOf(times)),
      until: standing ? Date.parse(standing) : Number.POSITIVE_INFINITY,
      name: i18n.t("plot.key.order"),
    },
    radiusM: null,
    speedSaid:
      standstill_ms === null ? "" : i18n.t("commandspage.stood", { ms: standstill_ms }),
  };
}

/**
 * Each moment in the order of time, those that never came last.
 *
 * @param {Order} order
 * @param {readonly string[]} transports
 * @param {I18n} i18n
 * @returns {import("../panels/timeline.js").Step[]}
 */
export function stepsOf({ kind, times }, transports, i18n) {
  const zero = Date.parse(zeroOf(times));
  /** @type {[string, string | null | undefined][]} */
  const moments = [
    ["pressed", times.pressed],
    ["accepted", times.requested],
    ...transports.flatMap(
      (id) =>
        /** @type {[string, string | undefined][]} */ ([
          [`sent_${id}`, times.sent[id]],
          [id, times.answer[id]],
        ]),
    ),
  ];
  if (kind === "stop") moments.push(["standing", times.standing]);
  return (
    moments
      .map(([name, at]) => ({ name, at: at ?? null }))
      // Robots answer a release by what they do; no page need tell of a press.
      .filter(({ name, at }) => at !== null || (kind === "stop" && name !== "pressed"))
      .sort((one, other) => momentOf(one) - momentOf(other))
      .map(({ name, at }) => {
        const verdict = at === null ? "missing" : "ok";
        return {
          name: i18n.t(`commandspage.moment.${name}`),
          at,
          verdict,
          state: at === null ? i18n.t("decision.verdict.missing") : "",
          took:
            at === null ? "" : i18n.t("decision.delay", { ms: Date.parse(at) - zero }),
          said: "",
        };
      })
  );
}

/** @param {{at: string | null}} step */
const momentOf = ({ at }) => (at === null ? Number.POSITIVE_INFINITY : Date.parse(at));
