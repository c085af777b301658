/** The map asks for the place that a robot is sent to: the next tap, unless one ends it. */

import { need, setHidden, setText } from "./dom.js";
import { sendGoal } from "./goal.js";

/** How long an answer stays on the map (ms). */
const TOLD_MS = 8000;

/**
 * @param {import("../main.js").App} app
 * @param {{askPlace: (answer: ((place: {x: number, y: number}) => void) | null) => void}} map
 */
export function createGoalMap({ i18n }, map) {
  const told = need("#sending");
  const ending = need("#sending-end");
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let clearing;
  let isAsking = false;

  /** @param {string} text */
  function tell(text) {
    clearTimeout(clearing);
    setText(told, text);
    setHidden(told, !text);
  }

  /** @param {boolean} on */
  function listen(on) {
    isAsking = on;
    setHidden(ending, !on);
  }

  /** @param {string} robotId */
  function ask(robotId) {
    listen(true);
    tell(i18n.t("goal.tap", { robot: robotId }));
    map.askPlace((place) => send(robotId, place));
  }

  /** @param {string} robotId @param {{x: number, y: number}} place */
  async function send(robotId, { x, y }) {
    listen(false);
    tell(i18n.t("goal.why.busy"));
    tell(await sendGoal(robotId, { kind: "here", x, y }, i18n));
    clearing = setTimeout(() => tell(""), TOLD_MS);
  }

  function end() {
    if (!isAsking) return;
    listen(false);
    map.askPlace(null);
    tell("");
  }

  ending.addEventListener("click", end);
  document.addEventListener("iveg:goal", (event) =>
    ask(/** @type {CustomEvent<string>} */ (event).detail),
  );
  return { end };
}
