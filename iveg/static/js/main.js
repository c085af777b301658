/**
 * Entry of every page: messages, connection and STOP first, then the route's panels.
 *
 * The panels of one route are loaded afterwards, so that their failure cannot take the
 * STOP controls along.
 */

import { loadI18n, switchLanguage } from "./core/i18n.js";
import { askedMoment } from "./core/moments.js";
import { createPainting } from "./core/painting.js";
import { LiveLine } from "./core/socket.js";
import { Store } from "./core/store.js";
import { createDialogs } from "./panels/dialogs.js";
import { all, setAttribute } from "./panels/dom.js";
import { createStatusLine } from "./panels/status_line.js";
import { StopPanel } from "./panels/stop.js";
import { createThemePanel } from "./panels/theme.js";

/**
 * The parts of the page that every panel is given.
 *
 * @typedef {{
 *   store: import("./core/store.js").Store,
 *   i18n: import("./core/i18n.js").I18n,
 *   line: LiveLine,
 *   painting: ReturnType<typeof createPainting>,
 *   dialogs: import("./panels/dialogs.js").Dialogs,
 *   stops: StopPanel,
 * }} App
 */

async function start() {
  const dialogs = createDialogs();
  createThemePanel();
  wireLanguage();
  const i18n = await loadI18n();
  if (!document.querySelector("#stops")) return;
  const store = new Store();
  const isPast = askedMoment(location.search) !== null;
  const draws = document.querySelector("#map") !== null && !isPast;
  const painting = createPainting();
  const { when: whenPainted } = painting;
  const line = new LiveLine({ url: liveUrl(), store, draws, whenPainted });
  const app = /** @type {App} */ ({ store, i18n, line, painting, dialogs });
  app.stops = new StopPanel(app);
  createStatusLine(app);
  const { startPage } = await import("./core/page.js");
  await startPage(app);
}

function wireLanguage() {
  const buttons = all("button[data-language]");
  for (const button of buttons) {
    button.addEventListener("click", () => {
      const language = /** @type {"es" | "en"} */ (button.dataset.language);
      switchLanguage(language);
      for (const other of buttons) {
        const isIts = other.dataset.language === button.dataset.language;
        setAttribute(other, "aria-pressed", String(isIts));
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
