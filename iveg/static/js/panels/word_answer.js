/**
 * A detector's word that nobody knows: an operator says whether it is a person.
 *
 * That it is none is asked twice; that it is one may always be said later.
 */

import { sendApi } from "../core/api.js";
import { make, setHidden, setText } from "./dom.js";

/** @typedef {import("../core/protocol.js").Alert} Alert */

const ASKED_MS = 8000;
const OPERATORS = new Set(["operator", "admin"]);

/**
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {typeof sendApi} [send] tests pass their own
 */
export function createWordAnswer(i18n, send = sendApi) {
  const element = make("div", "word-answer");
  const yes = make("button", "button");
  const no = make("button", "button");
  const told = make("p");
  told.setAttribute("role", "status");
  for (const button of [yes, no]) button.type = "button";
  element.append(yes, no, told);
  let askedUntilMs = 0;
  /** @type {Alert["slots"]} */
  let slots = {};

  /** @param {Alert} alert */
  function draw(alert) {
    slots = alert.slots;
    const name = alert.key.replace(/^alert\./, "");
    const may = OPERATORS.has(document.body.dataset.role ?? "");
    const isOpen = alert.cleared_at === null && may;
    setHidden(element, !isOpen || !["unknown_word", "harmless_word"].includes(name));
    setHidden(no, name === "harmless_word");
    setText(yes, i18n.t("words.is_person"));
    const isAsked = performance.now() < askedUntilMs;
    setText(no, i18n.t(isAsked ? "words.sure" : "words.is_not"));
  }

  /** @param {boolean} isPerson */
  async function answer(isPerson) {
    const { detector, word } = slots;
    const body = { detector, word, is_person: isPerson, sure: !isPerson };
    const { status } = await send("PUT", "words", body);
    setText(told, status === 204 ? "" : i18n.t("words.refused", { status }));
  }

  yes.addEventListener("click", () => answer(true));
  no.addEventListener("click", () => {
    const isAsked = performance.now() < askedUntilMs;
    askedUntilMs = isAsked ? 0 : performance.now() + ASKED_MS;
    setText(no, i18n.t(isAsked ? "words.is_not" : "words.sure"));
    return isAsked ? answer(false) : undefined;
  });
  return { element, draw };
}
