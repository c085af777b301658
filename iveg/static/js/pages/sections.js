/**
 * Sections of a long page: folded on a phone but for the first, open where there is room.
 * An address that names a section, or something in it, opens it.
 */

import { all } from "../panels/dom.js";

const NARROW = "(max-width: 767px)";

export function openSections() {
  if (!matchMedia(NARROW).matches)
    for (const section of all("details.section")) section.setAttribute("open", "");
  addEventListener("hashchange", openNamed);
  openNamed();
}

function openNamed() {
  const named = document.getElementById(location.hash.slice(1));
  const section = named?.closest("details");
  if (!named || !section) return;
  section.open = true;
  named.scrollIntoView();
}
