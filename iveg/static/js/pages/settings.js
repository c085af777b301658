/**
 * The Settings page: the rule in force, and the settings of this device.
 */

import { readApi } from "../core/api.js";
import { need, setHidden, setText } from "../panels/dom.js";
import { createSoundPanel } from "../panels/sound.js";
import { createClassForm } from "./classes.js";
import { createGuard } from "./guard.js";
import { readParameters, valueSaid } from "./parameters.js";
import { createRuleForm } from "./rule.js";
import { openSections } from "./sections.js";
import { startTrial } from "./trial.js";

/** @typedef {import("../core/protocol.js").Rule} Rule */

/** @param {import("../core/page.js").Page} page */
export function start({ store, i18n, tone, wake, installing }) {
  openSections();
  createSoundPanel(i18n, tone);
  wireWake(wake, i18n);
  wireInstall(installing, i18n);
  const parameters = readParameters();
  const guard = createGuard(store, i18n, parameters);
  const rule = createRuleForm(store, i18n, guard, parameters);
  const forms = [rule, createClassForm(store, i18n, guard)];
  startTrial(store, i18n, rule.values, parameters);
  addEventListener("beforeunload", (event) => {
    // The browser asks, with its own text, before typed values are lost.
    if (forms.some((form) => form.isDirty())) event.preventDefault();
  });

  function draw() {
    /** @type {Rule | null | undefined} */
    const rule = store.get("rule");
    if (rule) drawRule(rule, parameters, i18n);
  }

  store.subscribe("rule", draw);
  i18n.onChange(draw);
  draw();
  findRoutes().then((verbs) => {
    for (const form of forms) form.open(verbs);
  });
}

/**
 * @param {Rule} rule
 * @param {import("./parameters.js").Parameter[]} parameters
 * @param {import("../core/i18n.js").I18n} i18n
 */
function drawRule(rule, parameters, i18n) {
  setText(need("#rule-version"), String(rule.version));
  for (const one of parameters) {
    setText(need(`#rule-${one.word}`), valueSaid(one, rule, i18n));
  }
  setText(need("#rule-factor"), i18n.t("rule.unit.share", { value: rule.factor }));
}

/**
 * HTTP methods of this server for the rule, from its OpenAPI document.
 *
 * @returns {Promise<Set<string>>} `get`, `put`
 */
async function findRoutes() {
  const { body } = await readApi("/openapi.json");
  return new Set(Object.keys(body?.paths?.["/api/v1/rule"] ?? {}));
}

/** @param {import("../core/wakelock.js").WakeLock} wake
 * @param {import("../core/i18n.js").I18n} i18n */
function wireWake(wake, i18n) {
  const box = /** @type {HTMLInputElement} */ (need("#wake-on"));
  box.checked = wake.isWanted();
  box.disabled = !wake.isPossible();
  box.addEventListener("change", () => {
    wake.setWanted(box.checked);
    draw();
  });
  function draw() {
    const said = wake.isPossible() ? (box.checked ? "on" : "off") : "none";
    setText(need("#wake-state"), i18n.t(`device.wake_state.${said}`));
  }
  setHidden(need("#wake-state"), false);
  i18n.onChange(draw);
  draw();
}

/**
 * @param {import("../core/page.js").Page["installing"]} installing
 * @param {import("../core/i18n.js").I18n} i18n
 */
function wireInstall(installing, i18n) {
  const button = need("#install");
  function draw() {
    const state = installing.state();
    setHidden(button, state !== "ready");
    setText(need("#install-state"), i18n.t(`device.install_state.${state}`));
  }
  button.addEventListener("click", () => installing.install());
  installing.onChange(draw);
  i18n.onChange(draw);
  draw();
}
