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
const MOST_TEXT = 1000;

/**
 * @param {About} about
 * @param {import("../core/i18n.js").I18n} i18n
 */
export function createNotes(about, i18n) {
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

  async function load() {
    // A note is written after what it is about.
    const since = new Date(Date.parse(asked.at) - NEAR_MS).toISOString();
    const { status, body } = await readApi(`notes?${new URLSearchParams({ since })}`);
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
    await load();
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
