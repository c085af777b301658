/**
 * The health of the data path: a chip with the worst hop, a list with a sentence each.
 */

import { onBeat } from "../core/beat.js";
import { ageOf } from "../core/clock.js";
import { heardOf, judgeDataPath, sentenceOf } from "../pages/health_sentence.js";
import { fill, make, need, setAttribute, setText } from "./dom.js";

const TICK_MS = 1000;

/** @typedef {import("../core/protocol.js").Health["hops"][number]} Hop */

/** @param {import("../main.js").App} app */
export function createHealthPanel({ store, i18n, line }) {
  const chip = need("#health-chip");
  const panel = need("#health-panel");

  function draw() {
    /** @type {import("../core/protocol.js").Health | undefined} */
    const health = store.get("health") ?? undefined;
    drawChip(health?.hops ?? []);
    const ms = line.roundTripMs();
    const isOpen = store.connection.state === "open";
    setText(
      need("#health-latency"),
      isOpen && ms !== null ? i18n.t("health.latency", { ms }) : "",
    );
    drawList();
  }

  /** A closed list is written when it is opened: nobody reads it before. */
  function drawList() {
    if (!panel.hasAttribute("open")) return;
    /** @type {import("../core/protocol.js").Health | undefined} */
    const health = store.get("health") ?? undefined;
    const waitedS = health ? ageOf({ age_s: 0, receivedAtMs: health.receivedAtMs }) : 0;
    drawHops(health?.hops ?? [], waitedS);
    drawCounters(health?.counters ?? {});
  }

  /** The same verdict as on the fleet page. @param {Hop[]} hops */
  function drawChip(hops) {
    const heard = heardOf(store.robots().values());
    const isOpen = store.connection.state === "open";
    const { state, hop, key, slots } = judgeDataPath(hops, heard, isOpen);
    const live = heard.filter(({ link }) => link === "LIVE").length;
    const chipKey = hop === "robots" && heard.length ? "robots" : state;
    const counted = { hop: hop ?? "", live, total: heard.length };
    setAttribute(chip, "data-state", state);
    setText(need("#health-sentence"), i18n.t(`health.chip.${chipKey}`, counted));
    setAttribute(chip, "title", i18n.t(key, slots));
  }

  /** @param {Hop} hop */
  function said(hop) {
    const sentence = sentenceOf(hop);
    return i18n.t(sentence.key, sentence.slots);
  }

  /** @param {Hop[]} hops @param {number} waitedS since the server wrote the ages */
  function drawHops(hops, waitedS) {
    fill(need("#hops"), hops, makeItem, (item, hop) => {
      setAttribute(item, "data-state", hop.state);
      setText(need("b", item), i18n.t(`hop.${hop.hop}`));
      const age =
        hop.age_s === null ? "" : i18n.t("health.age", { age: hop.age_s + waitedS });
      setText(need("small", item), `${i18n.t(`health.state.${hop.state}`)} ${age}`);
      // The sentence about the lag is enough, and in the reader's language.
      const isTold = sentenceOf(hop).key === "health.lag";
      const detail =
        hop.detail && hop.state !== "ok" && !isTold ? ` (${hop.detail})` : "";
      setText(need("p", item), `${said(hop)}${detail}`);
    });
  }

  /** @param {Record<string, number>} counters */
  function drawCounters(counters) {
    fill(need("#counters"), Object.entries(counters), makeCounter, (row, counter) => {
      const [name, value] = counter;
      setText(row.children[0], name);
      setText(row.children[1], i18n.number(value, 0));
    });
  }

  store.subscribe("health", draw);
  store.subscribe("connection", draw);
  document.addEventListener("iveg:panel", drawList);
  i18n.onChange(draw);
  setInterval(onBeat, TICK_MS, draw);
  draw();
}

function makeCounter() {
  const row = make("div");
  row.append(make("dt"), make("dd"));
  return row;
}

function makeItem() {
  const item = make("li");
  item.append(make("span", "shape"), make("b"), make("small"), make("p"));
  return item;
}
