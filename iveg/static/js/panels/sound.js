/**
 * The controls of the sound: a test of it, and the switch of the single chime.
 */

import { need, setText } from "./dom.js";

/**
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {import("./tone.js").Tone} tone
 */
export function createSoundPanel(i18n, tone) {
  const others = /** @type {HTMLInputElement} */ (need("#sound-others"));
  let said = tone.canSound() ? "ready" : "blocked";
  others.checked = tone.hasChimes();
  others.addEventListener("change", () => {
    tone.setChimes(others.checked);
    if (others.checked) tone.chime();
  });
  const test = /** @type {HTMLButtonElement} */ (need("#sound-test"));
  test.addEventListener("click", () => {
    said = tone.test() ? "played" : "blocked";
    draw();
  });

  function draw() {
    setText(need("#sound-state"), i18n.t(`sound.${said}`));
  }

  i18n.onChange(draw);
  draw();
  test.disabled = others.disabled = false;
}
