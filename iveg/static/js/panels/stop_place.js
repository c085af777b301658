/**
 * The place of each STOP control: in the strip of every page, or on its robot's card.
 */

/** Controls that the strip has room for; those of a larger fleet are on the cards. */
const STRIP_HOLDS = 4;
const NARROW_STRIP_HOLDS = 3;
const LOW_STRIP_HOLDS = 2;

const PHONE = matchMedia(
  "(max-width: 767px) and (min-height: 501px), (max-width: 567px)",
);
const NARROW = matchMedia("(min-width: 1200px) and (max-width: 1399px)");
/** A phone lying down: the strip stands beside the map. */
const LOW = matchMedia(
  "(max-height: 500px) and (min-width: 568px) and (max-width: 1199px)",
);
/**
 * Cards hold their robot's control on a phone and in a big fleet, else the strip.
 *
 * @param {HTMLElement} strip
 * @param {ReadonlyMap<string, HTMLElement>} controls by robot, and `fleet`
 * @returns {() => void} to be called when a card or a control is new
 */
export function createPlace(strip, controls) {
  function place() {
    const isMany = controls.size - 1 > stripHolds();
    const isPanelOpen = document.body.hasAttribute("data-panel");
    const isOnCards = isMany || (PHONE.matches && !isPanelOpen);
    strip.toggleAttribute("data-many", isMany);
    for (const [id, control] of controls) {
      const slot = document.querySelector(
        `[data-robot="${CSS.escape(id)}"] [data-part="stop"]`,
      );
      const home = isOnCards && slot ? slot : strip;
      if (control.parentElement !== home) {
        home.insertBefore(
          control,
          home === strip ? (controls.get("fleet") ?? null) : null,
        );
      }
    }
  }

  for (const screen of [PHONE, NARROW, LOW]) screen.addEventListener("change", place);
  document.addEventListener("iveg:panel", place);
  return place;
}

function stripHolds() {
  if (LOW.matches) return LOW_STRIP_HOLDS;
  return NARROW.matches ? NARROW_STRIP_HOLDS : STRIP_HOLDS;
}
