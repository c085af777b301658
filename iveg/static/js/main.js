/**
 * Entry of every page: words, line, STOP first; whatever the route shows after it.
 *
 * What only one route needs is loaded afterwards, so that its failure cannot take the
 * STOP controls along.
 */

import { loadWords, switchLanguage } from "./i18n.js";
import { createBanner } from "./panels/banner.js";
import { createDialogs } from "./panels/dialogs.js";
import { all, setAttribute } from "./panels/dom.js";
import { createStopPanel } from "./panels/stop.js";
import { createThemePanel } from "./panels/theme.js";
import { connect } from "./socket.js";
import { createStore } from "./store.js";

/**
 * What panels are given.
 *
 * @typedef {{
 *   store: import("./store.js").Store,
 *   words: import("./i18n.js").Words,
 *   line: ReturnType<typeof connect>,
 *   dialogs: import("./panels/dialogs.js").Dialogs,
 *   stops: ReturnType<typeof createStopPanel>,
 * }} App
 */

async function start() {
  const dialogs = createDialogs();
  createThemePanel();
  wireLanguage();
  const words = await loadWords();
  if (!document.querySelector("#stops")) return;
  const store = createStore();
  const draws = document.querySelector("#map") !== null;
  const line = connect({ url: liveUrl(), store, draws });
  const app = /** @type {App} */ ({ store, words, line, dialogs });
  app.stops = createStopPanel(app);
  createBanner(app);
  const { startPage } = await import("./page.js");
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
