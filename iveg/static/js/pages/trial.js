/**
 * The trial of a rule: begun from what the form says, seen by all, ended or put in force
 * by operators; it acts on nothing.
 *
 * @typedef {import("../types.js").Trial} Trial
 * @typedef {import("../core/protocol.js").Rule} Rule
 */

import { readApi, sendApi } from "../core/api.js";
import { pastAddress } from "../core/moments.js";
import { make, need, setHidden, setText } from "../panels/dom.js";
import { dayAndTime } from "./history/local_time.js";
import { loweringsOf } from "./lowering.js";
import { valueSaid } from "./parameters.js";

const LOOK_MS = 2000;
const WRITERS = new Set(["operator", "admin"]);

/**
 * @param {import("../core/store.js").Store} store
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {() => Record<string, unknown>} values of the form of the rule
 * @param {import("./parameters.js").Parameter[]} parameters
 */
export function startTrial(store, i18n, values, parameters) {
  const may = WRITERS.has(document.body.dataset.role ?? "");
  /** @type {Trial | null} */
  let trial = null;
  let said = "";

  async function load() {
    if (document.hidden) return;
    const { status, body } = await readApi("rule/trial");
    if (status !== 200) return;
    trial = body.items[0] ?? null;
    draw();
  }

  /** @param {"POST" | "DELETE"} method @param {string} path @param {unknown} body */
  async function send(method, path, body) {
    const { status, body: told } = await sendApi(method, path, body);
    const isDone = status === 200 || status === 201;
    const why = String(told?.detail ?? status);
    said = isDone ? "" : i18n.t("rule.refused", { why });
    if (status === 409 && told?.why) said = i18n.t(`trial.refused.${told.why}`);
    if (status === 0) said = i18n.t("rows.offline");
    await load();
  }

  /** Asks again where the candidate protects less, as the editor of the rule does. */
  function promote() {
    /** @type {Rule | undefined} */
    const rule = store.get("rule");
    if (!rule || !trial) return;
    const lowerings = loweringsOf(parameters, rule, trial.rule);
    if (!lowerings.length) return putInForce();
    const told = lowerings.map(({ key, slots }) => i18n.t(key, slots));
    setText(need("#trial-sure-says"), [...told, sums()].filter(Boolean).join(" "));
    setHidden(need("#trial-sure"), false);
    need("#trial-no").focus();
  }

  function putInForce() {
    setHidden(need("#trial-sure"), true);
    return send("POST", "rule/trial/promote", { version: store.get("rule")?.version });
  }

  function sums() {
    const found = trial?.comparison;
    if (!found) return "";
    const minutes = (/** @type {Record<string, number>} */ of) =>
      Object.values(of).reduce((sum, s) => sum + s, 0) / 60;
    return i18n.t("trial.sums", {
      minutes: found.compared_s / 60,
      in_force: minutes(found.in_force.slowed_s),
      candidate: minutes(found.candidate.slowed_s),
      would_slow: found.would_slow,
      would_not: found.would_not,
    });
  }

  function draw() {
    setHidden(need("#trial-begin"), !may || trial !== null);
    setHidden(need("#trial-end"), !may || trial === null);
    setHidden(need("#trial-promote"), !may || trial === null);
    setHidden(need("#trial-found"), trial === null);
    if (trial === null) setHidden(need("#trial-sure"), true);
    setText(need("#trial-state"), `${said} ${stateSaid()}`.trim());
    if (trial === null) return;
    setText(need("#trial-sums"), sums());
    need("#trial-rows").replaceChildren(
      ...trial.differences.map((one) => rowOf(one, i18n)),
    );
    setHidden(need("#trial-none"), trial.differences.length > 0);
  }

  function stateSaid() {
    if (trial === null) return i18n.t(may ? "trial.off" : "trial.off_viewer");
    const { rule, by, since } = trial;
    const told = parameters.map(
      (one) => `${i18n.t(`rule.part.${one.word}`)} ${valueSaid(one, rule, i18n)}`,
    );
    return i18n.t("trial.on", { by, at: dayAndTime(since), values: told.join("; ") });
  }

  need("#trial-begin").addEventListener("click", () =>
    send("POST", "rule/trial", values()),
  );
  need("#trial-end").addEventListener("click", () => send("DELETE", "rule/trial", {}));
  need("#trial-promote").addEventListener("click", promote);
  need("#trial-yes").addEventListener("click", putInForce);
  need("#trial-no").addEventListener("click", () =>
    setHidden(need("#trial-sure"), true),
  );
  i18n.onChange(draw);
  document.addEventListener("visibilitychange", load);
  setInterval(load, LOOK_MS);
  load();
}

/**
 * @param {Trial["differences"][number]} one
 * @param {import("../core/i18n.js").I18n} i18n
 */
function rowOf({ robot_id, kind, reason, cause, decision_id, began, ended }, i18n) {
  const line = make("tr");
  const open = make("td");
  const links = make("div", "line");
  const past = make("a", "button", i18n.t("trial.open_past"));
  past.href = pastAddress(Date.parse(began) / 1000);
  links.append(past);
  if (decision_id !== null) {
    const decision = make("a", "button", i18n.t("trial.open_decision"));
    decision.href = `/decisions/${encodeURIComponent(decision_id)}`;
    links.append(decision);
  }
  open.append(links);
  // A candidate counts people by itself: its names need not be those on the map.
  const who = kind === "frees" || reason === "robot" ? (cause ?? "") : "";
  const lasted = ended === null ? null : (Date.parse(ended) - Date.parse(began)) / 1000;
  line.append(
    make("td", "time", dayAndTime(began)),
    make("td", "", robot_id),
    make("td", "", i18n.t(`trial.kind.${kind}`)),
    make("td", "", causeSaid(reason, who, i18n)),
    make(
      "td",
      "number",
      lasted === null ? i18n.t("trial.goes_on") : i18n.t("trial.seconds", { lasted }),
    ),
    open,
  );
  return line;
}

/** @param {string} reason @param {string} who @param {import("../core/i18n.js").I18n} i18n */
function causeSaid(reason, who, i18n) {
  const why = i18n.t(`trial.reason.${reason}`);
  return who ? i18n.t("trial.cause", { why, who }) : why;
}
