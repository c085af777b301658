/**
 * The messages of the page in the reader's language, and the switch between languages.
 *
 * Templates come from `/static/i18n/{es,en}.json`; `messages.js` says how they are
 * written.  An element names its message in `data-i18n`, that of an attribute in
 * `data-i18n-<attribute>`, and the values of placeholders in `data-slots` (JSON), so a
 * switch needs no reload.
 *
 * @typedef {import("./messages.js").Language} Language
 * @typedef {import("./messages.js").Slots} Slots
 * @typedef {import("./messages.js").Blocks} Blocks
 * @typedef {ReturnType<typeof createI18n>} I18n
 */

import { languageOf, Messages } from "./messages.js";

const COOKIE = "iveg_language";
const CHANGED = "iveg:language";
const TRANSLATED = ["aria-label", "title", "placeholder", "alt"];

/**
 * Loads the messages in the language that the server chose for this reader.
 *
 * @returns {Promise<I18n>}
 */
export async function loadI18n() {
  const i18n = createI18n(fetchBlocks);
  await i18n.use(languageOf(document.documentElement.lang));
  document.addEventListener(CHANGED, () => {
    i18n.use(languageOf(document.documentElement.lang));
  });
  return i18n;
}

/**
 * Switches the whole page, and remembers it for the next one.
 *
 * @param {Language} language
 */
export function switchLanguage(language) {
  document.documentElement.lang = language;
  // biome-ignore lint/suspicious/noDocumentCookie: cookieStore needs a secure context
  document.cookie = `${COOKIE}=${language}; Path=/; Max-Age=31536000; SameSite=Strict`;
  document.dispatchEvent(new CustomEvent(CHANGED));
}

/**
 * @param {(language: Language) => Promise<Blocks>} load
 */
export function createI18n(load) {
  let messages = new Messages("es", {});
  /** @type {Set<() => void>} */
  const listeners = new Set();
  /** @param {string} key @param {Slots} [slots] */
  const t = (key, slots) => messages.say(key, slots);
  return {
    t,
    /** Whether a message of this name exists. @param {string} key */
    has: (key) => messages.find(key) !== null,
    /** @param {number} value @param {number} decimals */
    number: (value, decimals) => messages.number(value, decimals),
    /** @param {string | number | Date} at ISO-8601, Unix seconds or a date */
    time: (at) => messages.time(at),
    language: () => messages.language,
    /**
     * Calls `fn` after every switch.
     *
     * @param {() => void} fn
     * @returns {() => void} ends it
     */
    onChange(fn) {
      listeners.add(fn);
      return () => void listeners.delete(fn);
    },
    /** @param {Language} language */
    async use(language) {
      messages = new Messages(language, await load(language));
      if (typeof document !== "undefined") translate(document, t);
      for (const fn of listeners) fn();
    },
  };
}

/**
 * Writes every message below `root` anew.
 *
 * @param {ParentNode} root
 * @param {(key: string, slots?: Slots) => string} say
 */
export function translate(root, say) {
  for (const element of /** @type {NodeListOf<HTMLElement>} */ (
    root.querySelectorAll("[data-i18n]")
  )) {
    element.textContent = say(String(element.dataset.i18n), slotsOf(element));
  }
  for (const attribute of TRANSLATED) {
    const name = `data-i18n-${attribute}`;
    for (const element of root.querySelectorAll(`[${name}]`)) {
      const key = String(element.getAttribute(name));
      element.setAttribute(attribute, say(key, slotsOf(element)));
    }
  }
}

/** @param {Element} element @returns {Slots} */
function slotsOf(element) {
  return JSON.parse(element.getAttribute("data-slots") ?? "{}");
}

/** @param {Language} language @returns {Promise<Blocks>} */
async function fetchBlocks(language) {
  const answer = await fetch(`/static/i18n/${language}.json`);
  return answer.json();
}
