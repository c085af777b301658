/**
 * Notes of people about a moment: read by all, written by operators, never changed.
 *
 * @typedef {{at: string, by: string, text: string, decision_id: string | null,
 *   robot_id: string | null}} Note
 * @typedef {{at: string, robot_id?: string | null, decision_id?: string | null}} About
 *   what a note is pinned to; `at` is ISO-8601
 */

import { readApi, sendApi } from "../core/api.js";
import { dayAndTime } from "../pages/history/local_time.js";
import { make, setHidden, setText } from "./dom.js";

const WRITERS = new Set(["operator", "admin"]);
/** As far to both sides as an incident pack reaches. */
const NEAR_MS = 30_000;
/** Who shows notes of several moments asks once for all of them. */
const SHARED_MS = 5000;
const EARLIER_MS = 3_600_000;
const MOST_TEXT = 1000;

/** @param {number} sinceMs */
const readNotes = (sinceMs) => {
  const since = new Date(sinceMs).toISOString();
  return readApi(`notes?${new URLSearchParams({ since })}`);
};

/**
 * Reads once for all who ask within seconds; `isAnew`: somebody has just written one.
 *
 * @param {(sinceMs: number) => Promise<import("../core/api.js").Answer>} [read]
 */
export function sharedNotes(read = readNotes) {
  let sinceMs = Number.POSITIVE_INFINITY;
  let askedAtMs = Number.NEGATIVE_INFINITY;
  /** @type {ReturnType<typeof readNotes> | null} */
  let answer = null;
  return (/** @type {number} */ wantedMs, isAnew = false) => {
    const nowMs = performance.now();
    const isOld = nowMs - askedAtMs > SHARED_MS;
    if (answer && !isAnew && !isOld && wantedMs >= sinceMs) return answer;
    if (isOld || wantedMs < sinceMs) sinceMs = wantedMs - EARLIER_MS;
    askedAtMs = nowMs;
    answer = read(sinceMs);
    return answer;
  };
}

/**
 * @param {About} about
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {ReturnType<typeof sharedNotes>} [read]
 */
export function createNotes(about, i18n, read = readNotes) {
  const element = make("details", "notes");
  const title = make("summary");
  const list = make("ul", "notes__list");
  const form = make("form", "notes__form no-print");
  const input = make("textarea");
  const send = make("button", "button");
  const said = make("p", "notes__said");
  said.setAttribute("role", "status");
  input.maxLength = MOST_TEXT;
  input.required = true;
  input.rows = 2;
  send.type = "submit";
  form.append(input, send);
  element.append(title, list, form, said);
  /** @type {Note[]} */
  let notes = [];
  let asked = about;
  let failure = 0;

  async function load(isAnew = false) {
    // A note is written after what it is about.
    const { status, body } = await read(Date.parse(asked.at) - NEAR_MS, isAnew);
    failure = status === 200 ? 0 : status || -1;
    if (status === 200) notes = body.items;
    draw();
  }

  /** @param {About} next what is shown now; what is being written stays */
  function move(next) {
    asked = next;
    draw();
  }

  function draw() {
    const shown = notesAbout(notes, asked);
    setText(title, i18n.t("notes.title", { count: shown.length }));
    list.replaceChildren(...shown.map((note) => make("li", "", saidOf(note, i18n))));
    const isWriter = WRITERS.has(document.body.dataset.role ?? "");
    setHidden(form, !isWriter);
    setHidden(element, !shown.length && !isWriter && !failure);
    input.setAttribute("aria-label", i18n.t("notes.text"));
    input.placeholder = i18n.t("notes.text");
    setText(send, i18n.t("notes.send"));
    setText(said, failure ? i18n.t("notes.failed", { status: failure }) : "");
  }

  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    send.disabled = true;
    const { status } = await sendApi("POST", "notes", { text: input.value, ...asked });
    send.disabled = false;
    failure = status === 201 ? 0 : status || -1;
    if (status !== 201) return draw();
    input.value = "";
    await load(true);
  });
  draw();
  void load();
  return { element, move, draw };
}

/**
 * Those pinned to the record itself, or to a moment near it; the oldest first.
 *
 * @param {readonly Note[]} notes @param {About} about
 */
export function notesAbout(notes, { at, decision_id = null }) {
  const near = (/** @type {Note} */ note) =>
    Math.abs(Date.parse(note.at) - Date.parse(at)) <= NEAR_MS;
  return notes
    .filter(
      (note) =>
        near(note) || (decision_id !== null && note.decision_id === decision_id),
    )
    .sort((one, other) => one.at.localeCompare(other.at));
}

/** @param {Note} note @param {import("../core/i18n.js").I18n} i18n */
const saidOf = ({ at, by, text }, i18n) =>
  i18n.t("notes.said", { at: dayAndTime(at, { withYear: true }), by, text });
