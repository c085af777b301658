/**
 * The History page: reads a range, draws it, and says when it cannot.
 */

import { loadI18n } from "../core/i18n.js";
import { createDecisionPanel } from "../panels/decision.js";
import { all, need, setHidden, setText } from "../panels/dom.js";
import { onThemeChange } from "../panels/theme.js";
import { createAsked, queryOf } from "./history/asked.js";
import { drawCharts } from "./history/charts.js";
import { dayAndTime, wallText } from "./history/local_time.js";
import { commandCells, createTable, decisionCells } from "./history/tables.js";

/** @typedef {import("./history/asked.js").Asked} Asked */

const ROWS = 20;

/** An answer without the requested data; `status` 0 is no answer at all. */
class AnswerError extends Error {
  /** @param {number} status */
  constructor(status) {
    super(String(status));
    this.status = status;
  }
}

async function start() {
  const i18n = await loadI18n();
  const decision = createDecisionPanel(
    /** @type {any} */ ({ i18n, dialogs: besideOthers() }),
  );
  /** @type {Asked | null} */
  let asked = null;
  /** @type {import("./history/charts.js").Charts | null} */
  let charts = null;
  /** @type {Asked | null} what the charts show, while another range is on its way */
  let drawn = null;
  /** @type {string | null} the key of what is wrong, and its status */
  let wrong = null;
  let status = 0;
  let running = new AbortController();

  const tables = {
    decisions: createTable("decisions", i18n, decisionCells, (cursor) =>
      readMore("decisions", cursor),
    ),
    commands: createTable("commands", i18n, commandCells, (cursor) =>
      readMore("commands", cursor),
    ),
  };
  const picker = createAsked(load);

  async function load() {
    running.abort();
    running = new AbortController();
    const { signal } = running;
    asked = picker.read();
    if (asked === null) return fail("range");
    say();
    linkExports(asked);
    need("#history").toggleAttribute("data-busy", true);
    try {
      await show(asked, signal);
    } catch (error) {
      if (!signal.aborted) failWith(error);
    } finally {
      if (!signal.aborted) need("#history").toggleAttribute("data-busy", false);
    }
  }

  /** @param {Asked} wanted @param {AbortSignal} signal */
  async function show(wanted, signal) {
    const query = queryOf(wanted);
    const [{ figures }, decisions, commands] = await Promise.all([
      read(`history/charts?${query}`, signal),
      read(`decisions?${query}&limit=${ROWS}`, signal),
      read(`commands?${query}&limit=${ROWS}`, signal),
    ]);
    fail(null);
    charts = figures;
    drawn = wanted;
    tables.decisions.show(decisions);
    tables.commands.show(commands);
    await draw();
  }

  async function draw() {
    if (charts === null || drawn === null) return;
    try {
      await drawCharts(charts, drawn, i18n);
    } catch {
      fail("library");
    }
  }

  /** @param {"decisions" | "commands"} list @param {string} cursor */
  async function readMore(list, cursor) {
    try {
      const query = queryOf(/** @type {Asked} */ (asked));
      query.set("limit", String(ROWS));
      query.set("cursor", cursor);
      return await read(`${list}?${query}`, running.signal);
    } catch (error) {
      failWith(error);
      throw error;
    }
  }

  /** @param {unknown} error */
  function failWith(error) {
    status = error instanceof AnswerError ? error.status : 0;
    if (status === 0) fail("offline");
    else fail([401, 503].includes(status) ? String(status) : "other");
  }

  /** @param {string | null} key */
  function fail(key) {
    wrong = key;
    say();
  }

  function say() {
    const line = need("#history-error");
    setHidden(line, wrong === null);
    if (wrong !== null) setText(line, i18n.t(`history.error.${wrong}`, { status }));
    if (asked === null) return;
    const since = dayAndTime(asked.since, { withYear: true });
    const until = dayAndTime(asked.until, { withYear: true });
    setText(need("#history-range"), i18n.t("history.shown", { since, until }));
  }

  need("#rows-decisions").addEventListener("click", (event) => {
    const target = /** @type {Element} */ (event.target);
    const button = /** @type {HTMLElement | null} */ (
      target.closest("[data-decision]")
    );
    if (button) decision.open(String(button.dataset.decision), button);
  });
  i18n.onChange(() => {
    if (asked) linkExports(asked);
    say();
    draw();
  });
  onThemeChange(draw);
  await load();
}

/**
 * @param {string} path @param {AbortSignal} signal
 * @returns {Promise<any>}
 */
async function read(path, signal) {
  const headers = { Accept: "application/json" };
  /** @type {Response} */
  let answer;
  try {
    answer = await fetch(`/api/v1/${path}`, { headers, signal });
  } catch {
    throw new AnswerError(0);
  }
  if (!answer.ok) throw new AnswerError(answer.status);
  return answer.json();
}

/** @param {Asked} asked */
function linkExports(asked) {
  const links = /** @type {HTMLAnchorElement[]} */ (all("a[data-export]"));
  for (const link of links) {
    const query = queryOf(asked);
    query.set("format", String(link.dataset.format));
    const day = wallText(asked.since).slice(0, 10);
    link.download = `${link.dataset.export}-${day}.${link.dataset.format}`;
    link.href = `/api/v1/${link.dataset.export}?${query}`;
  }
}

/**
 * Opens the decision's panel beside those of `main.js`, by the same rules:
 * never modal, `Esc` or a press elsewhere closes it, the focus goes back.
 */
function besideOthers() {
  const panel = /** @type {HTMLDialogElement} */ (need("#decision-panel"));
  /** @type {HTMLElement | null} */
  let opener = null;
  const close = () => {
    if (!panel.open) return;
    panel.close();
    opener?.focus();
  };
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") close();
  });
  document.addEventListener("click", (event) => {
    const target = /** @type {Element} */ (event.target);
    if (target.closest("[data-stop], [data-decision]")) return;
    if (!panel.contains(target) || target.closest("[data-closes]")) close();
  });
  return {
    /** @param {HTMLDialogElement} dialog @param {HTMLElement | null} by */
    open(dialog, by) {
      opener = by;
      if (!dialog.open) dialog.show();
    },
  };
}

start();
