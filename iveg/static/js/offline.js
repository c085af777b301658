/**
 * The offline page: in the reader's language and theme, and gone as soon as iVeg answers.
 *
 * Alone: nothing else of the page can be loaded where it is shown.
 */

const AGAIN_MS = 3000;

/** @param {string} name of a cookie @returns {string | undefined} */
function cookie(name) {
  const kept = document.cookie.split("; ").find((one) => one.startsWith(`${name}=`));
  return kept?.slice(name.length + 1);
}

function dress() {
  const { documentElement: root } = document;
  const asked = cookie("iveg_language") ?? navigator.language.slice(0, 2);
  root.lang = asked === "es" ? "es" : "en";
  root.dataset.said = root.lang;
  root.dataset.theme = cookie("iveg_theme") ?? "auto";
}

async function tryAgain() {
  try {
    const { ok } = await fetch("/healthz", { cache: "no-store" });
    if (ok) location.reload();
  } catch {
    // Still no network.
  }
}

dress();
// Opened by its own address it has nothing to come back to.
if (location.pathname !== "/static/offline.html") {
  setInterval(tryAgain, AGAIN_MS);
  addEventListener("online", tryAgain);
}
