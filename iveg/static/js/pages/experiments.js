/**
 * The experiments page: the paper's evaluation, started, watched and opened.
 *
 * @typedef {import("../types.js").Experiment} Experiment
 * @typedef {import("../types.js").Experiments} Experiments
 */

import { readApi, sendApi } from "../core/api.js";
import { make, need, setHidden, setText } from "../panels/dom.js";
import { dayAndTime } from "./history/local_time.js";

const EVERY_MS = 2000;
const RUNNERS = new Set(["operator", "admin"]);

/** @param {import("../core/page.js").Page} page */
export function start({ i18n }) {
  const may = RUNNERS.has(document.body.dataset.role ?? "");
  const begins = /** @type {HTMLButtonElement} */ (need("#experiment-start"));
  const size = /** @type {HTMLSelectElement} */ (need("#experiment-size"));
  /** @type {Experiments | null} */
  let told = null;
  let status = 200;
  let detail = "";

  async function load() {
    if (document.hidden) return;
    take(await readApi("experiments"));
  }

  /** @param {import("../core/api.js").Answer} answer */
  function take({ status: code, body }) {
    status = code;
    detail = "";
    if (code === 200) told = body;
    draw();
  }

  /** @param {string} path @param {unknown} body */
  async function order(path, body) {
    begins.disabled = true;
    const answer = await sendApi("POST", path, body);
    await load();
    if (answer.status === 202) return;
    status = answer.status;
    detail = String(answer.body?.why ?? answer.body?.detail ?? "");
    draw();
  }

  function draw() {
    const failed = need("#experiment-error");
    setHidden(failed, status === 200);
    setText(failed, failure(status, detail, i18n));
    if (told === null) return;
    const running = told.items.find(({ state }) => state === "running");
    begins.disabled = !may || told.refused !== null;
    setHidden(need("#experiment-stop"), !may || !running);
    setText(need("#experiment-says"), saidOf(running, i18n));
    setText(need("#experiment-note"), noteOf(told, may, i18n));
    setHidden(need("#experiments-empty"), told.items.length > 0);
    const rows = told.items.map((one) => rowOf(one, i18n));
    need("#experiments tbody").replaceChildren(...rows);
  }

  need("#experiment-form").addEventListener("submit", (event) => {
    event.preventDefault();
    order("experiments", { size: size.value });
  });
  need("#experiment-stop").addEventListener("click", () =>
    order("experiments/stop", {}),
  );
  i18n.onChange(draw);
  setInterval(load, EVERY_MS);
  load();
}

/** @param {number} status @param {string} detail @param {import("../core/i18n.js").I18n} i18n */
function failure(status, detail, i18n) {
  if (!status) return i18n.t("rows.offline");
  const refused = `experiments.refused.${detail}`;
  return i18n.t(i18n.has(refused) ? refused : "rows.failed", { status });
}

/**
 * @param {Experiments} told @param {boolean} may
 * @param {import("../core/i18n.js").I18n} i18n
 */
function noteOf({ refused }, may, i18n) {
  if (!may) return i18n.t("experiments.role");
  return refused ? i18n.t(`experiments.refused.${refused}`) : "";
}

/** @param {Experiment | undefined} one @param {import("../core/i18n.js").I18n} i18n */
function saidOf(one, i18n) {
  if (!one) return i18n.t("experiments.idle");
  const { name, done, of, run, phase, left_s } = one;
  const left = `${Math.floor(left_s / 60)}:${String(left_s % 60).padStart(2, "0")}`;
  if (!run || !phase) return i18n.t("experiments.between", { name, done, of, left });
  const where = i18n.t(`experiments.phase.${phase}`);
  return i18n.t("experiments.at", { name, done, of, run, phase: where, left });
}

/** @param {Experiment} one @param {import("../core/i18n.js").I18n} i18n */
function rowOf(one, i18n) {
  const row = make("tr");
  const head = make("th", "", one.name);
  head.setAttribute("scope", "row");
  row.append(head, make("td", "", dayAndTime(one.began_at)));
  row.append(make("td", "", stateOf(one, i18n)));
  row.append(make("td", "number", `${one.done}/${one.of}`));
  row.append(make("td", "", withOf(one, i18n)));
  row.append(make("td", "", protectedOf(one, i18n)), filesOf(one, i18n));
  return row;
}

/** @param {Experiment} one @param {import("../core/i18n.js").I18n} i18n */
function withOf({ profile, seed, load }, i18n) {
  if (profile === null || seed === null) return "";
  const told = i18n.t(`experiments.profile.${profile}`);
  const said = i18n.t("experiments.with", { profile: told, seed: String(seed) });
  return load === null ? said : `${said} ${i18n.t("experiments.load", { load })}`;
}

/** @param {Experiment} one @param {import("../core/i18n.js").I18n} i18n */
function protectedOf({ protected: told }, i18n) {
  if (told === null) return "";
  const { slowed, encounters, never_slowed: never } = told;
  if (slowed === null) return i18n.t("experiments.nobody_near");
  // Never rounded up to all of it.
  const percent = Math.floor(slowed * 1000) / 10;
  return i18n.t("experiments.protected", { slowed: percent, encounters, never });
}

/** @param {Experiment} one @param {import("../core/i18n.js").I18n} i18n */
function stateOf({ state, why }, i18n) {
  const said = i18n.t(`experiments.state.${state}`);
  if (!why) return said;
  const known = `experiments.why.${why}`;
  return `${said}: ${i18n.has(known) ? i18n.t(known) : why}`;
}

/** @param {Experiment} one @param {import("../core/i18n.js").I18n} i18n */
function filesOf({ name, state, report }, i18n) {
  const cell = make("td");
  if (!report || state === "running") return cell;
  const told = i18n.t(`experiments.${state === "done" ? "report" : "partial"}`);
  for (const [file, text] of [
    ["report", told],
    ["result", "JSON"],
  ]) {
    const link = make("a", "button", text);
    link.href = `/api/v1/experiments/${name}/${file}`;
    if (file === "report") {
      link.target = "_blank";
      link.search = `lang=${i18n.language()}&theme=${document.documentElement.dataset.theme}`;
    }
    cell.append(link, " ");
  }
  return cell;
}
