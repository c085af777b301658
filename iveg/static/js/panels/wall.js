/**
 * The screen of a wall: full, without pointer and sections, on a session that may look and
 * stop and free nothing (SECURITY.md, "Roles").  Nothing on it moves by itself.
 */

import { need, setHidden, setText } from "./dom.js";

const ADDRESS = "/?wall";
/** How long a pointer is seen after it moved (ms). */
const SEEN_MS = 3000;

/** @param {import("../main.js").App} app */
export function createWall({ i18n, dialogs }) {
  const full = need("#fullscreen");
  setHidden(full, !document.fullscreenEnabled);
  full.addEventListener("click", toggleFullscreen);
  need("#wall-begin").addEventListener("click", async () => {
    if (!(await lower())) return setText(need("#wall-note"), i18n.t("wall.failed"));
    if (document.body.dataset.route !== "live") return location.assign(ADDRESS);
    history.replaceState(null, "", ADDRESS);
    dialogs.close();
    begin();
    return toggleFullscreen();
  });
  if (new URLSearchParams(location.search).has("wall")) begin();
}

/** Gives up the rights of this browser's session but to look and to stop. */
async function lower() {
  try {
    const headers = { "X-IVEG": "1" };
    return (await fetch("/wall", { method: "POST", headers })).ok;
  } catch {
    return false;
  }
}

function begin() {
  const { body } = document;
  body.dataset.role = "viewer";
  body.toggleAttribute("data-wall", true);
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let rest;
  const see = () => {
    clearTimeout(rest);
    body.toggleAttribute("data-idle", false);
    rest = setTimeout(() => body.toggleAttribute("data-idle", true), SEEN_MS);
  };
  addEventListener("pointermove", see);
  see();
}

async function toggleFullscreen() {
  try {
    await (document.fullscreenElement
      ? document.exitFullscreen()
      : document.documentElement.requestFullscreen());
  } catch {
    // A browser that refuses leaves the page as it was.
  }
}
