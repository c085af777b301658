/**
 * Alarms: a bell with the worst and the number, a list with acknowledgement.
 *
 * Colour, shape and text say the priority (ISA-18.2); P1 sounds until somebody
 * acknowledges it.  The server groups repetitions and keeps who, when and the note.
 */

import { make, need, setAttribute, setHidden, setText } from "./dom.js";
import { createTone } from "./tone.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../protocol.js").Alert} Alert */

/** @param {App} app */
export function createAlertsPanel({ store, words }) {
  const list = need("#alerts");
  const button = need("#alerts-button");
  const tone = createTone();
  /** @type {Map<string, HTMLLIElement>} */
  const items = new Map();
  /** @type {Map<string, number>} HTTP status of acknowledgements that failed */
  const failures = new Map();

  function draw() {
    /** @type {Alert[]} */
    const alerts = [...(store.get("alerts") ?? [])].sort(byUrgency);
    const isOpen = alerts.filter(({ cleared_at }) => !cleared_at);
    setText(need("#alerts-count"), String(isOpen.length));
    setAttribute(button, "data-worst", isOpen[0]?.priority ?? "none");
    button.title = words.t("header.alerts_count", { count: isOpen.length });
    setHidden(need("#alerts-empty"), alerts.length > 0);
    tone.sound(
      isOpen.some((alert) => alert.priority === "P1" && !alert.acknowledged_at),
    );
    for (const id of items.keys()) {
      if (!alerts.some(({ alert_id }) => alert_id === id)) drop(id);
    }
    alerts.forEach((alert, i) => {
      const item = itemOf(alert);
      // Moving an element takes the focus out of the note that is being written.
      if (list.children[i] !== item) list.insertBefore(item, list.children[i] ?? null);
      drawItem(item, alert);
    });
  }

  /** @param {string} id */
  function drop(id) {
    items.get(id)?.remove();
    items.delete(id);
    failures.delete(id);
  }

  /** @param {Alert} alert */
  function itemOf(alert) {
    const known = items.get(alert.alert_id);
    if (known) return known;
    const item = makeItem((note) => acknowledge(alert.alert_id, note));
    items.set(alert.alert_id, item);
    return item;
  }

  /** @param {HTMLElement} item @param {Alert} alert */
  function drawItem(item, alert) {
    setAttribute(item, "data-priority", alert.priority);
    setAttribute(item, "data-alert", alert.key);
    const key = alert.key.startsWith("alert.") ? alert.key : `alert.${alert.key}`;
    const priority = words.t(`alert.priority.${alert.priority}`);
    setText(need("b", item), `${priority}: ${words.t(key, alert.slots)}`);
    setText(need("small", item), factsOf(alert));
    setHidden(need("form", item), alert.acknowledged_at !== null);
    const input = /** @type {HTMLInputElement} */ (need("input", item));
    input.placeholder = words.t("alert.note");
    input.setAttribute("aria-label", words.t("alert.note"));
    setText(need("button", item), words.t("alert.acknowledge"));
    const status = failures.get(alert.alert_id);
    setText(
      need("p", item),
      status === undefined ? "" : words.t("alert.failed", { status }),
    );
  }

  /** @param {Alert} alert */
  function factsOf(alert) {
    return [
      words.t("alert.since", { at: alert.raised_at }),
      alert.count > 1 && words.t("alert.times", { count: alert.count }),
      alert.cleared_at && words.t("alert.cleared", { at: alert.cleared_at }),
      alert.acknowledged_at &&
        words.t("alert.acknowledged", {
          who: alert.acknowledged_by,
          at: alert.acknowledged_at,
        }),
      alert.note,
    ]
      .filter(Boolean)
      .join(" · ");
  }

  /** @param {string} id @param {string} note */
  async function acknowledge(id, note) {
    const status = await post(id, note);
    if (status >= 200 && status < 300) failures.delete(id);
    else failures.set(id, status);
    draw();
  }

  store.subscribe("alerts", draw);
  words.onChange(draw);
  draw();
}

/** @param {(note: string) => void} onAcknowledge */
function makeItem(onAcknowledge) {
  const item = make("li");
  const body = make("div");
  const form = make("form");
  const input = make("input");
  const submit = make("button", "button");
  submit.type = "submit";
  input.maxLength = 200;
  form.append(input, submit);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    onAcknowledge(input.value);
  });
  body.append(make("b"), make("small"), form, make("p"));
  item.append(make("span", "shape"), body);
  return item;
}

/** Open before cleared, urgent before others, new before old. @param {Alert} a @param {Alert} b */
function byUrgency(a, b) {
  return (
    Number(Boolean(a.cleared_at)) - Number(Boolean(b.cleared_at)) ||
    a.priority.localeCompare(b.priority) ||
    b.raised_at.localeCompare(a.raised_at)
  );
}

/** @param {string} id @param {string} note @returns {Promise<number>} 0: no answer */
async function post(id, note) {
  try {
    const headers = { "Content-Type": "application/json", "X-IVEG": "1" };
    const answer = await fetch(`/api/v1/alerts/${encodeURIComponent(id)}/acknowledge`, {
      method: "POST",
      headers,
      body: JSON.stringify({ note }),
    });
    return answer.status;
  } catch {
    return 0;
  }
}
