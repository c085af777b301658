/**
 * Panels that open and close, and never cover a STOP.
 *
 * They are not modal: a modal dialog would make the STOP strip inert.  One is open at a
 * time; `Esc` closes it and does nothing else; focus goes in, and back to the opener.
 */

import { all, setAttribute } from "./dom.js";

/** @typedef {ReturnType<typeof createDialogs>} Dialogs */

export function createDialogs() {
  /** @type {HTMLDialogElement | null} */
  let current = null;
  /** @type {HTMLElement | null} */
  let opener = null;

  /** @param {HTMLDialogElement} dialog @param {HTMLElement | null} [by] */
  function open(dialog, by = null) {
    if (current) close(false);
    current = dialog;
    opener = by;
    dialog.show();
    if (by) setAttribute(by, "aria-expanded", "true");
    tell(true);
  }

  /** @param {boolean} [isDone] whether the focus goes back to where it came from */
  function close(isDone = true) {
    current?.close();
    current = null;
    tell(false);
    if (opener) setAttribute(opener, "aria-expanded", "false");
    if (isDone && opener?.isConnected) opener.focus();
    opener = null;
  }

  /** @param {HTMLElement} button */
  function toggle(button) {
    const dialog = /** @type {HTMLDialogElement | null} */ (
      document.getElementById(String(button.dataset.opens))
    );
    if (!dialog) return;
    if (dialog === current && opener === button) close();
    else open(dialog, button);
  }

  /** @param {HTMLElement} button */
  function toggleDrawer(button) {
    const id = String(button.dataset.drawer);
    const drawer = document.getElementById(id);
    const isOpen = drawer?.toggleAttribute("data-open") ?? false;
    for (const other of all(`[data-drawer="${id}"]`)) {
      setAttribute(other, "aria-expanded", String(isOpen));
    }
    tell(isOpen);
    if (isOpen) drawer?.focus();
  }

  /** @param {HTMLElement} drawer */
  function closeDrawer(drawer) {
    const button = all(`[data-drawer="${drawer.id}"]`)[0];
    if (button) toggleDrawer(button);
  }

  document.addEventListener("click", (event) => {
    const target = /** @type {Element} */ (event.target);
    const button = /** @type {HTMLElement | null} */ (
      target.closest("[data-opens], [data-closes], [data-drawer]")
    );
    if (button?.dataset.opens) toggle(button);
    else if (button?.dataset.drawer) toggleDrawer(button);
    else if (button) close();
    else if (current && !current.contains(target) && !target.closest("[data-stop]")) {
      close(false);
    }
  });
  document.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    if (current) close();
    else for (const drawer of all("[data-open]")) closeDrawer(drawer);
  });

  return { open, close, isOpen: (/** @type {Element} */ it) => it === current };
}

/**
 * Announces it: STOP controls on cards must not stay under a panel.
 *
 * @param {boolean} isOpen
 */
function tell(isOpen) {
  document.body.toggleAttribute("data-panel", isOpen);
  document.dispatchEvent(new CustomEvent("iveg:panel"));
}
