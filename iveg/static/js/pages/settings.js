/**
 * The Settings page: the rule in force, and the settings of this device.
 */

import { readApi } from "../core/api.js";
import { need, setHidden, setText } from "../panels/dom.js";
import { createSoundPanel } from "../panels/sound.js";
import { createClassForm } from "./classes.js";
import { createGuard } from "./guard.js";
import { createMessagesForm } from "./messages.js";
import { createRuleForm } from "./rule.js";
import { openSections } from "./sections.js";
import { createSignInCode } from "./sign_in_code.js";

/** @typedef {import("../core/protocol.js").Rule} Rule */

/** @param {import("../core/page.js").Page} page */
export function start({ store, i18n, tone, wake, installing }) {
  openSections();
  createSoundPanel(i18n, tone);
  wireWake(wake, i18n);
  wireInstall(installing, i18n);
  const guard = createGuard(store, i18n);
  const forms = [
    createRuleForm(store, i18n, guard),
    createClassForm(store, i18n, guard),
  ];
  const messages = createMessagesForm(i18n);
  // Without a link there is no code of it.
  if (document.querySelector("#code-show")) createSignInCode(i18n);
  addEventListener("beforeunload", (event) => {
    // The browser asks, with its own text, before typed values are lost.
    if ([...forms, messages].some((form) => form.isDirty())) event.preventDefault();
  });

  function draw() {
    /** @type {Rule | null | undefined} */
    const rule = store.get("rule");
    if (rule) drawRule(rule, i18n);
  }

  store.subscribe("rule", draw);
  i18n.onChange(draw);
  draw();
  findRoutes().then((verbs) => {
    for (const form of forms) form.open(verbs);
  });
}

/** @param {Rule} rule @param {import("../core/i18n.js").I18n} i18n */
function drawRule(rule, i18n) {
  const share = (/** @type {number} */ value) => i18n.t("rule.percent", { value });
  setText(need("#rule-version"), String(rule.version));
  setText(need("#rule-threshold"), share(rule.confidence_threshold));
  setText(need("#rule-radius"), i18n.t("rule.metres", { value: rule.radius_m }));
  setText(need("#rule-factor"), share(rule.factor));
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
