/**
 * Entry of every page: words, line, STOP first; whatever the route shows after it.
 *
 * What only one route needs is loaded afterwards, so that its failure cannot take the
 * STOP controls along.
 */

import { loadI18n, switchLanguage } from "./core/i18n.js";
import { createPainting } from "./core/painting.js";
import { connect } from "./core/socket.js";
import { createStore } from "./core/store.js";
import { createBanner } from "./panels/banner.js";
import { createDialogs } from "./panels/dialogs.js";
import { all, setAttribute } from "./panels/dom.js";
import { createStopPanel } from "./panels/stop.js";
import { createThemePanel } from "./panels/theme.js";

/**
 * What panels are given.
 *
 * @typedef {{
 *   store: import("./core/store.js").Store,
 *   i18n: import("./core/i18n.js").I18n,
 *   line: ReturnType<typeof connect>,
 *   painting: ReturnType<typeof createPainting>,
 *   dialogs: import("./panels/dialogs.js").Dialogs,
 *   stops: ReturnType<typeof createStopPanel>,
 * }} App
 */

async function start() {
  const dialogs = createDialogs();
  createThemePanel();
  wireLanguage();
  const i18n = await loadI18n();
  if (!document.querySelector("#stops")) return;
  const store = createStore();
  const draws = document.querySelector("#map") !== null;
  const painting = createPainting();
  const line = connect({ url: liveUrl(), store, draws, whenPainted: painting.when });
  const app = /** @type {App} */ ({ store, i18n, line, painting, dialogs });
  app.stops = createStopPanel(app);
  createBanner(app);
  const { startPage } = await import("./core/page.js");
  await startPage(app);
}

function wireLanguage() {
  const buttons = all("button[data-language]");
  for (const button of buttons) {
    button.addEventListener("click", () => {
      switchLanguage(/** @type {"es" | "en"} */ (button.dataset.language));
      for (const other of buttons) {
        setAttribute(other, "aria-pressed", String(other === button));
      }
    });
  }
}

function liveUrl() {
  const url = new URL("/live", location.href);
  url.protocol = url.protocol.replace("http", "ws");
  return url.href;
}

start();
