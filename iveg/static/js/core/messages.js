/**
 * The messages of one language: templates with named placeholders, and how values are
 * written into them.
 *
 * Templates stand in nested blocks.  `nav.live` walks down them; a block answers for its
 * own name, and for names it lacks, with its `default`.  Placeholders are `{name}`,
 * `{name:2}` (decimals) or `{name:format}` with one of `FORMATS`.
 *
 * @typedef {"es" | "en"} Language
 * @typedef {string | number | boolean | null | undefined} Slot value of a placeholder
 * @typedef {Record<string, Slot | object>} Slots
 * @typedef {{[name: string]: string | Blocks}} Blocks
 */

import { laneName, placeName } from "./lanes.js";

const LOCALES = { es: "es-ES", en: "en-GB" };
/** Greenhouses live by the clock on their wall; data stay in UTC. */
export const TIME_ZONE = "Europe/Madrid";
const NOTHING = "—";
/** Keys whose templates are kept in pieces; a value may be part of a key. */
const PIECES_KEPT = 1000;
const PERCENT = { style: /** @type {const} */ ("percent"), maximumFractionDigits: 0 };

/** @type {Record<string, (value: any, messages: Messages, slots: Slots) => string>} */
const FORMATS = {
  // Rounded down: a share below a threshold is never written as the threshold.
  percent: (value, messages) => messages.percent(Math.floor(value * 100 + 1e-6) / 100),
  span: spanOf,
  time: (value, messages) => messages.time(value),
  class: (value, messages) => messages.named("class", value),
  a: (value, messages) => messages.named("class.a", value),
  who: (value, messages) => messages.named("who", value),
  why: (value, messages) => messages.named("why", value),
  hop: (value, messages) => messages.named("hop", value),
  part: (value, messages) => messages.named("part", value),
  doubt: (value, messages) => messages.named("doubt", value),
  parameter: (value, messages) => messages.named("rule.part", value),
  class_of: (value, messages) => messages.named("rule.class", value),
  data: (value, messages) => messages.named("stream", value),
  drive: (value, messages) => messages.named("drive", value),
  lane: (value, messages) => laneName(String(value), messages.say),
  place: (value, messages) => placeName(String(value), messages.say),
  // What the grower calls it in this language, as the equipment's file says.
  own: (value, messages, slots) => String(slots[`tile_${messages.language}`] ?? value),
  person: trackOf,
  sentence: sentenceOf,
};

/** The language of a tag such as `en-GB`; Spanish where there is no other.
 * @param {string} tag @returns {Language} */
export const languageOf = (tag) => (tag.startsWith("en") ? "en" : "es");

export class Messages {
  #blocks;
  #locale;
  #clock;
  #percents;
  /** @type {Map<number | null, Intl.NumberFormat>} by decimals; null: as they come */
  #numbers = new Map();
  /** @type {Map<string, string[]>} templates of keys, in pieces */
  #pieces = new Map();

  /** @param {Language} language @param {Blocks} blocks */
  constructor(language, blocks) {
    this.language = language;
    this.#blocks = blocks;
    this.#locale = LOCALES[language];
    this.#clock = clockOf(this.#locale);
    this.#percents = new Intl.NumberFormat(this.#locale, PERCENT);
  }

  /**
   * A message with its placeholders filled; an unknown key shows itself.
   *
   * @param {string} key
   * @param {Slots} [slots]
   */
  say = (key, slots = {}) => {
    const pieces = this.#pieces.get(key) ?? this.#cut(key);
    if (pieces === null) return key;
    let said = pieces[0];
    for (let i = 1; i < pieces.length; i += 3) {
      said += this.#write(slots[pieces[i]], pieces[i + 1], slots) + pieces[i + 2];
    }
    return said.trim();
  };

  /**
   * A template as text, name, format, text, name, format … text: a page says the same
   * few hundred sentences thousands of times a minute.
   *
   * @param {string} key
   * @returns {string[] | null} null: unknown
   */
  #cut(key) {
    const template = this.find(key);
    if (template === null) return null;
    const pieces = template.split(/\{(\w+)(?::(\w+))?\}/);
    if (this.#pieces.size >= PIECES_KEPT) this.#pieces.clear();
    this.#pieces.set(key, pieces);
    return pieces;
  }

  /** @param {string} key @returns {string | null} */
  find(key) {
    /** @type {string | Blocks | undefined} */
    let found = this.#blocks;
    for (const name of key.split(".")) {
      found = typeof found === "object" ? (found[name] ?? found.default) : undefined;
    }
    if (typeof found === "object") found = found.default;
    return typeof found === "string" ? found : null;
  }

  /** The name of a value in a block; the value itself where the block has none.
   * @param {string} block @param {unknown} value */
  named(block, value) {
    return this.find(`${block}.${value}`) ?? String(value);
  }

  /** @param {number} share 0–1 */
  percent(share) {
    return this.#percents.format(share);
  }

  /** @param {number} value @param {number} decimals */
  number(value, decimals) {
    if (!Number.isFinite(value)) return NOTHING;
    // "-0,0" of a robot at rest says nothing that "0,0" does not.
    const rounded = Math.abs(value) < 0.5 * 10 ** -decimals ? 0 : value;
    return this.#format(decimals).format(rounded);
  }

  /** A format costs a hundred times what its use does. @param {number | null} decimals */
  #format(decimals) {
    const known = this.#numbers.get(decimals);
    if (known) return known;
    const format = new Intl.NumberFormat(this.#locale, optionsOf(decimals));
    this.#numbers.set(decimals, format);
    return format;
  }

  /** @param {string | number | Date} at ISO-8601, Unix seconds or a date */
  time(at) {
    const date = typeof at === "number" ? new Date(at * 1000) : new Date(at);
    return Number.isNaN(date.getTime()) ? NOTHING : this.#clock.format(date);
  }

  /** @param {Slot | object} value @param {string | undefined} form @param {Slots} slots */
  #write(value, form, slots) {
    if (value === null || value === undefined || value === "") return NOTHING;
    if (form && form in FORMATS) return FORMATS[form](value, this, slots);
    if (typeof value !== "number") return String(value);
    return form ? this.number(value, Number(form)) : this.#format(null).format(value);
  }
}

/** `P3-5f0c…` is a person's number in the greenhouse; on a page it would read as a priority.
 * @param {unknown} value @param {Messages} messages */
function trackOf(value, messages) {
  const [, kind, n] = /^([PR])(\d+)(?:-[0-9a-f]+)?$/.exec(String(value)) ?? [];
  return kind
    ? messages.say(`class.track.${kind}`, { n })
    : messages.named("class", value);
}

/** @param {any} value a key, or `{key, slots}`
 * @param {Messages} messages @param {Slots} slots */
function sentenceOf(value, messages, slots) {
  const { key = value, slots: own = slots } =
    typeof value === "object" ? value : { key: value };
  return messages.say(String(key).startsWith("alert.") ? key : `alert.${key}`, own);
}

/** A duration for people: `42 s`, `3 min 42 s`. @param {number} seconds */
function spanOf(seconds) {
  const whole = Math.round(seconds);
  const [minutes, rest] = [Math.floor(whole / 60), whole % 60];
  if (!minutes) return `${whole} s`;
  return minutes < 60
    ? `${minutes} min ${rest} s`
    : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

/** @param {number | null} decimals @returns {Intl.NumberFormatOptions} */
const optionsOf = (decimals) =>
  decimals === null
    ? {}
    : {
        minimumFractionDigits: decimals,
        maximumFractionDigits: decimals,
        useGrouping: false,
      };

/** @param {string} locale */
function clockOf(locale) {
  return new Intl.DateTimeFormat(locale, {
    timeZone: TIME_ZONE,
    hourCycle: "h23",
    hour: "2-digit",
    minute: "2-digit",
    second: "2-digit",
  });
}
