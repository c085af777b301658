/**
 * The page's words: sentences with named holes, in the reader's language and habits.
 *
 * Templates live in `/static/i18n/{es,en}.json`, in nested blocks; `nav.live` walks down
 * them, and a block answers for its own name, and for names it lacks, with its `default`.  Holes are `{name}`,
 * `{name:2}` (decimals) or `{name:format}` with one of the formats below.  Elements name
 * their sentence in `data-i18n`, an attribute's in `data-i18n-<attribute>`, and the
 * values of its holes in `data-slots` (JSON), so a switch needs no reload.
 *
 * @typedef {"es" | "en"} Language
 * @typedef {string | number | boolean | null | undefined} Slot
 * @typedef {Record<string, Slot | object>} Slots
 * @typedef {{[name: string]: string | Blocks}} Blocks
 * @typedef {ReturnType<typeof createI18n>} I18n
 */

import { laneName } from "./lanes.js";

/** @type {readonly Language[]} */
export const LANGUAGES = ["es", "en"];
const LOCALES = { es: "es-ES", en: "en-GB" };
/** Greenhouses live by the clock on their wall; data stay in UTC. */
const TIME_ZONE = "Europe/Madrid";
const COOKIE = "iveg_language";
const CHANGED = "iveg:language";
const TRANSLATED = ["aria-label", "title", "placeholder", "alt"];
const NOTHING = "—";

/**
 * Loads the words in the language that the server chose for this reader.
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
 * I18n of blocks that are here already: in a worker, which has no page.
 *
 * @param {string} language
 * @param {Blocks} blocks
 * @returns {Promise<I18n>}
 */
export async function i18nOf(language, blocks) {
  const i18n = createI18n(async () => blocks);
  await i18n.use(languageOf(language));
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
  /** @type {Language} */
  let language = "es";
  /** @type {Blocks} */
  let blocks = {};
  /** @type {Map<string, Intl.NumberFormat>} */
  let numbers = new Map();
  let clock = clockOf(language);
  /** @type {Set<() => void>} */
  const listeners = new Set();

  /** @param {string} key @returns {string | null} */
  function find(key) {
    /** @type {string | Blocks | undefined} */
    let found = blocks;
    for (const name of key.split(".")) {
      found = typeof found === "object" ? (found[name] ?? found.default) : undefined;
    }
    if (typeof found === "object") found = found.default;
    return typeof found === "string" ? found : null;
  }

  /** @param {number} value @param {Intl.NumberFormatOptions} options */
  function formatted(value, options) {
    const name = JSON.stringify(options);
    const format =
      numbers.get(name) ?? new Intl.NumberFormat(LOCALES[language], options);
    numbers.set(name, format);
    return format.format(value);
  }

  /** @param {number} value @param {number} decimals */
  function number(value, decimals) {
    if (!Number.isFinite(value)) return NOTHING;
    // "-0,0" of a robot at rest says nothing that "0,0" does not.
    const rounded = Math.abs(value) < 0.5 * 10 ** -decimals ? 0 : value;
    return formatted(rounded, {
      minimumFractionDigits: decimals,
      maximumFractionDigits: decimals,
      useGrouping: false,
    });
  }

  /** @param {string | number | Date} at ISO-8601, Unix seconds or a date */
  function time(at) {
    const date = typeof at === "number" ? new Date(at * 1000) : new Date(at);
    if (Number.isNaN(date.getTime())) return NOTHING;
    return clock.format(date);
  }

  /** @param {string} block @param {unknown} value */
  const named = (block, value) => find(`${block}.${value}`) ?? String(value);

  /** @type {Record<string, (value: any, slots: Slots) => string>} */
  const formats = {
    // Down, so that what lies below a threshold is never written as the threshold.
    percent: (value) =>
      formatted(Math.floor(value * 100 + 1e-6) / 100, {
        style: "percent",
        maximumFractionDigits: 0,
      }),
    span: spanOf,
    time,
    class: (value) => named("class", value),
    a: (value) => find(`class.a.${value}`) ?? String(value),
    why: (value) => named("why", value),
    hop: (value) => named("hop", value),
    data: (value) => named("stream", value),
    drive: (value) => named("drive", value),
    lane: (value) => laneName(String(value), say),
    person: trackOf,
    sentence: (value, slots) => sentenceOf(value, slots),
  };

  /** `P3` is a person's number in the greenhouse; on a page it would read as a priority.
   * @param {unknown} value */
  function trackOf(value) {
    const [, kind, n] = /^([PR])(\d+)$/.exec(String(value)) ?? [];
    return kind ? say(`class.track.${kind}`, { n }) : named("class", value);
  }

  /** @param {any} value a key, or `{key, slots}` @param {Slots} slots */
  function sentenceOf(value, slots) {
    const { key = value, slots: own = slots } =
      typeof value === "object" ? value : { key: value };
    return say(String(key).startsWith("alert.") ? key : `alert.${key}`, own);
  }

  /** @param {Slot | object} value @param {string | undefined} form @param {Slots} slots */
  function write(value, form, slots) {
    if (value === null || value === undefined || value === "") return NOTHING;
    if (form && form in formats) return formats[form](value, slots);
    if (typeof value !== "number") return String(value);
    return form ? number(value, Number(form)) : formatted(value, {});
  }

  /**
   * The sentence with its holes filled; an unknown key shows itself.
   *
   * @param {string} key
   * @param {Slots} [slots]
   */
  function say(key, slots = {}) {
    const template = find(key);
    if (template === null) return key;
    return template
      .replace(/\{(\w+)(?::(\w+))?\}/g, (_, name, form) =>
        write(slots[name], form, slots),
      )
      .trim();
  }

  return {
    t: say,
    /** Whether a sentence of this name exists. @param {string} key */
    has: (key) => find(key) !== null,
    number,
    time,
    language: () => language,
    /** Some blocks as they are, for who says them elsewhere. @param {string[]} names */
    blocks: (...names) => Object.fromEntries(names.map((name) => [name, blocks[name]])),
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
    /** @param {Language} wanted */
    async use(wanted) {
      blocks = await load(wanted);
      language = wanted;
      numbers = new Map();
      clock = clockOf(wanted);
      if (typeof document !== "undefined") translate(document, say);
      for (const fn of listeners) fn();
    },
  };
}

/**
 * Writes every sentence below `root` anew.
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

/** A time that people read: `42 s`, `3 min 42 s`. @param {number} seconds */
function spanOf(seconds) {
  const whole = Math.round(seconds);
  const [minutes, rest] = [Math.floor(whole / 60), whole % 60];
  if (!minutes) return `${whole} s`;
  return minutes < 60
    ? `${minutes} min ${rest} s`
    : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

/** @param {Element} element @returns {Slots} */
function slotsOf(element) {
  return JSON.parse(element.getAttribute("data-slots") ?? "{}");
}

/** A format costs a hundred times what its use does. @param {Language} language */
function clockOf(language) {
  return new Intl.DateTimeFormat(LOCALES[language], {
    timeZone: TIME_ZONE,
    hourCycle: "h23",
    hour: "2-digit",
    minute: "2-digit",
    second: "2-digit",
  });
}

/** @param {string} text @returns {Language} */
function languageOf(text) {
  return LANGUAGES.find((language) => text.startsWith(language)) ?? "es";
}

/** @param {Language} language @returns {Promise<Blocks>} */
async function fetchBlocks(language) {
  const answer = await fetch(`/static/i18n/${language}.json`);
  return answer.json();
}
