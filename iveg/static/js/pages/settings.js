/**
 * The Settings page: the rule in force, and what this device remembers.
 */

import { readApi } from "../api.js";
import { need, setHidden, setText } from "../panels/dom.js";
import { createSoundPanel } from "../panels/sound.js";
import { createClassForm } from "./classes.js";
import { createGuard } from "./guard.js";
import { createRuleForm } from "./rule.js";

/** @typedef {import("../protocol.js").Rule} Rule */

/** @param {import("../page.js").Page} page */
export function start({ store, words, tone, wake, installing }) {
  createSoundPanel(words, tone);
  wireWake(wake, words);
  wireInstall(installing, words);
  const guard = createGuard(store, words);
  const forms = [
    createRuleForm(store, words, guard),
    createClassForm(store, words, guard),
  ];
  addEventListener("beforeunload", (event) => {
    // The browser asks, in its own words, before what was typed is lost.
    if (forms.some((form) => form.isDirty())) event.preventDefault();
  });

  function draw() {
    /** @type {Rule | null | undefined} */
    const rule = store.get("rule");
    if (rule) drawRule(rule, words);
  }

  store.subscribe("rule", draw);
  words.onChange(draw);
  draw();
  findRoutes().then((verbs) => {
    for (const form of forms) form.open(verbs);
  });
}

/** @param {Rule} rule @param {import("../i18n.js").Words} words */
function drawRule(rule, words) {
  const share = (/** @type {number} */ value) => words.t("rule.percent", { value });
  setText(need("#rule-version"), String(rule.version));
  setText(need("#rule-threshold"), share(rule.confidence_threshold));
  setText(need("#rule-radius"), words.t("rule.metres", { value: rule.radius_m }));
  setText(need("#rule-factor"), share(rule.factor));
}

/**
 * Which verbs this server knows for the rule, from its own document.
 *
 * @returns {Promise<Set<string>>} `get`, `put`
 */
async function findRoutes() {
  const { body } = await readApi("/openapi.json");
  return new Set(Object.keys(body?.paths?.["/api/v1/rule"] ?? {}));
}

/** @param {import("../wakelock.js").WakeLock} wake
 * @param {import("../i18n.js").Words} words */
function wireWake(wake, words) {
  const box = /** @type {HTMLInputElement} */ (need("#wake-on"));
  box.checked = wake.isWanted();
  box.disabled = !wake.isPossible();
  box.addEventListener("change", () => {
    wake.setWanted(box.checked);
    draw();
  });
  function draw() {
    const said = wake.isPossible() ? (box.checked ? "on" : "off") : "none";
    setText(need("#wake-state"), words.t(`device.wake_state.${said}`));
  }
  setHidden(need("#wake-state"), false);
  words.onChange(draw);
  draw();
}

/**
 * @param {import("../page.js").Page["installing"]} installing
 * @param {import("../i18n.js").Words} words
 */
function wireInstall(installing, words) {
  const button = need("#install");
  function draw() {
    const state = installing.state();
    setHidden(button, state !== "ready");
    setText(need("#install-state"), words.t(`device.install_state.${state}`));
  }
  button.addEventListener("click", () => installing.install());
  installing.onChange(draw);
  words.onChange(draw);
  draw();
}
