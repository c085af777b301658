import {
  createNotes,
  notesAbout,
  sharedNotes,
} from "../../iveg/static/js/panels/notes.js";
import { equal, test } from "./harness.js";

const at = "2026-11-24T10:00:00.000Z";
const words = /** @type {any} */ ({
  t: (/** @type {string} */ key, /** @type {any} */ slots) => slots?.text ?? key,
});

/** @param {string} when @param {string | null} decision_id */
const note = (when, decision_id = null) => ({
  at: when,
  by: "ana",
  text: when,
  robot_id: null,
  decision_id,
});

test("25.7: a record shows the notes of its half minute, and its own of any time", () => {
  const notes = [
    note("2026-11-24T12:00:00.000Z", "D1"),
    note("2026-11-24T10:00:29.000Z"),
    note("2026-11-24T10:00:31.000Z"),
    note("2026-11-24T12:00:00.000Z", "D2"),
  ];
  equal(
    notesAbout(notes, { at, decision_id: "D1" }).map((one) => one.at),
    ["2026-11-24T10:00:29.000Z", "2026-11-24T12:00:00.000Z"],
  );
  equal(notesAbout(notes, { at }).length, 1);
});

/** What was asked of a server that takes no note.
 * @param {() => Promise<void>} body @returns {Promise<any[]>} */
async function answered(body) {
  const asked = /** @type {any[]} */ ([]);
  const real = window.fetch;
  window.fetch = async (url, request) => {
    asked.push([url, request?.method ?? "GET", request?.body ?? ""]);
    return new Response('{"items": []}', { status: request?.method ? 503 : 200 });
  };
  await body();
  window.fetch = real;
  return asked;
}

const soon = () => new Promise((resolve) => setTimeout(resolve, 0));

test("25.7: a note that could not be written stays in its field, and says so", async () => {
  document.body.dataset.role = "operator";
  const asked = await answered(async () => {
    const { element } = createNotes({ at, robot_id: "AGI" }, words);
    document.body.append(element);
    const field = /** @type {HTMLTextAreaElement} */ (
      element.querySelector("textarea")
    );
    field.value = "lens dirty";
    element.querySelector("form")?.requestSubmit();
    await soon();
    await soon();
    equal(field.value, "lens dirty");
    equal(element.querySelector("[role=status]")?.textContent, "notes.failed");
    element.remove();
  });
  equal(JSON.parse(asked.at(-1)[2]), { text: "lens dirty", at, robot_id: "AGI" });
});

test("25.7: who may not write is offered nothing", async () => {
  document.body.dataset.role = "viewer";
  await answered(async () => {
    const { element } = createNotes({ at }, words);
    await soon();
    equal(element.hidden, true);
  });
});

test("notes of many alerts are asked for once, and anew where one was written", async () => {
  /** @type {number[]} */
  const asked = [];
  const read = sharedNotes(async (sinceMs) => {
    asked.push(sinceMs);
    return { status: 200, body: { items: [] } };
  });
  const first = read(10_000_000);
  equal(read(20_000_000) === first, true);
  equal(read(9_000_000) === first, true);
  equal(asked.length, 1);
  equal(asked[0] <= 9_000_000, true);

  read(20_000_000, true);
  equal(asked, [asked[0], asked[0]]);
  read(0);
  equal(asked.length, 3);
});
