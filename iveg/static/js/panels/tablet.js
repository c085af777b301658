/**
 * A shared tablet: whose it is, for how long still, and its lock.
 *
 * The server holds the truth; the page only counts down what it was told, and what it was
 * told too long ago counts as locked.  STOP works all the same.
 */

import { readApi, sendApi } from "../core/api.js";
import { make, need, setHidden, setText } from "./dom.js";
import { askProof, asksForProof } from "./proof.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../types").Tablet} Tablet */
/** @typedef {import("../core/api.js").Answer} Answer */

const ASK_MS = 5000;

/**
 * Seconds until a tablet locks.
 *
 * @param {Tablet} tablet
 * @param {number} agoS since the server said so
 */
export const leftOf = ({ holder, left_s }, agoS) =>
  holder === null ? 0 : Math.max(0, left_s - agoS);

/** As a clock: 100 → `1:40`. @param {number} seconds */
export function countdown(seconds) {
  const whole = Math.ceil(seconds);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

/**
 * Why a PIN was refused.
 *
 * @param {Answer} answer
 * @returns {import("../types.js").Sentence}
 */
export function saidOfPin({ status, body }) {
  const { left = 0, blocked_s = 0 } = body ?? {};
  const slots = { left, wait: countdown(blocked_s) };
  if (blocked_s > 0) return { key: "tablet.blocked", slots };
  if (status === 403) return { key: "tablet.wrong", slots };
  return { key: status ? "tablet.failed" : "rows.offline", slots: { status } };
}

/** @param {App} app */
export function createTablet({ i18n, dialogs }) {
  const form = /** @type {HTMLFormElement} */ (need("#tablet-form"));
  const pin = /** @type {HTMLInputElement} */ (need("#tablet-pin"));
  const opener = /** @type {HTMLButtonElement} */ (need("#tablet"));
  /** @type {Tablet | undefined} */
  let tablet;
  let toldAt = 0;
  let chosen = "";

  const leftS = () =>
    tablet ? leftOf(tablet, (performance.now() - toldAt) / 1000) : 0;

  function draw() {
    const left = leftS();
    const isOpen = left > 0;
    const name = (isOpen ? tablet?.holder : tablet?.name) ?? "";
    setText(need("#tablet-said"), isOpen ? name : i18n.t("tablet.locked"));
    setText(need("#tablet-left"), isOpen ? countdown(left) : name);
    opener.dataset.state = isOpen ? "open" : "locked";
    setHidden(need("#tablet-lock"), !isOpen);
    document.body.dataset.role = isOpen ? tablet?.role : "viewer";
    const told = isOpen ? "tablet.is_open" : "tablet.is_locked";
    setText(need("#tablet-told"), i18n.t(told, { name }));
  }

  function drawPeople() {
    const people = tablet?.people ?? [];
    need("#tablet-people").replaceChildren(...people.map(makePerson));
    setHidden(need("#tablet-nobody"), people.length > 0);
  }

  /** @param {Tablet["people"][number]} person */
  function makePerson({ person_id, name }) {
    const button = make("button", "button", name);
    button.type = "button";
    button.addEventListener("click", () => {
      chosen = person_id;
      setText(need("#tablet-whose"), i18n.t("tablet.pin_of", { name }));
      setText(need("#tablet-note"), "");
      setHidden(form, false);
      pin.value = "";
      pin.focus();
    });
    return button;
  }

  /** @param {Answer} answer */
  function take({ status, body }) {
    if (status !== 200) return;
    tablet = body;
    toldAt = performance.now();
    draw();
  }

  async function ask() {
    take(await readApi("tablet"));
  }

  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const body = { person_id: chosen, pin: pin.value };
    const answer = await sendApi("POST", "tablet/unlock", body);
    pin.value = "";
    take(answer);
    if (answer.status === 200) return dialogs.close();
    const { key, slots } = saidOfPin(answer);
    return setText(need("#tablet-note"), i18n.t(key, slots));
  });
  opener.addEventListener("click", async () => {
    setHidden(form, true);
    setText(need("#tablet-note"), "");
    await ask();
    drawPeople();
  });
  need("#tablet-lock").addEventListener("click", async () => {
    take(await sendApi("POST", "tablet/lock", {}));
    dialogs.close();
  });
  i18n.onChange(draw);
  setInterval(draw, 1000);
  setInterval(ask, ASK_MS);
  document.addEventListener("visibilitychange", ask);
  ask();
  opener.disabled = false;
}

/** Makes this browser a tablet, from the panel of shared screens. @param {App} app */
export function createTabletMaker(app) {
  const form = need("#tablet-make");
  const name = /** @type {HTMLInputElement} */ (need("#tablet-name"));
  const note = need("#tablet-make-note");
  async function begin() {
    const answer = await sendApi("POST", "tablet", { name: name.value.trim() });
    if (answer.status === 201) return location.assign("/");
    if (asksForProof(answer)) return askProof(app, form, begin);
    const { status } = answer;
    const key = status === 422 ? "once.invalid" : "tablet.failed";
    return setText(note, app.i18n.t(status ? key : "rows.offline", { status }));
  }
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    begin();
  });
  /** @type {HTMLButtonElement} */ (need("#tablet-share")).disabled = false;
}
