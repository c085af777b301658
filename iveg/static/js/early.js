/**
 * Hears STOP before the page's modules are there, and says when they do not come.
 *
 * The first script of every page, alone, and no module: a browser runs it before it shows
 * a button, so that no press can come too early.  What is pressed is shown and sent at
 * once and kept in this tab as `panels/press.js` keeps it, which goes on with it as the
 * same press.  Release and Resume are not heard here: they stay disabled, and a late one
 * could be decided on an old picture.
 */
{
  const KEPT = "iveg_kept_stops";
  const AGAIN_MS = 1000;
  const HTTP_LIMIT_MS = 3000;
  const DRAW_MS = 200;
  /** A press that is older than this and not taken is shown as not sent. */
  const LATE_MS = 2000;
  /** How long after `pointerup` a click still belongs to the same gesture (ms). */
  const GESTURE_MS = 400;
  /** How long the modules may take without a word (ms). */
  const PATIENCE_MS = 4000;

  /**
   * @typedef {{robotId: string | null, pressId: string, pressedAt: number,
   *   wallMs: number, taken?: boolean}} EarlyPress `taken`: by the server
   */

  /** @type {Map<string | null, EarlyPress>} newest by robot; null is the fleet */
  const presses = new Map();
  let isGesture = false;
  /** Whether this tab keeps presses, so that the modules can go on with them. */
  let isKept = true;

  /** Whether `panels/stop.js` has the controls now. */
  const isOver = () => document.body?.hasAttribute("data-loaded") ?? false;

  /** @param {string} robotId or `fleet` */
  const hear = (robotId) => {
    const id = robotId === "fleet" ? null : robotId;
    const known = presses.get(id);
    if (known && !known.taken) return;
    const bytes = [...crypto.getRandomValues(new Uint8Array(16))];
    const pressId = bytes.map((one) => one.toString(16).padStart(2, "0")).join("");
    const wallMs = Date.now();
    begin({ robotId: id, pressId, pressedAt: wallMs / 1000, wallMs });
  };

  /** @param {EarlyPress} press */
  const begin = (press) => {
    presses.set(press.robotId, press);
    keep();
    draw();
    carry(press);
  };

  /** @param {EarlyPress} press */
  const carry = async (press) => {
    while (!isOver() || !isKept) {
      const status = await post(press);
      if (status === 200 || status === 202) {
        press.taken = true;
        keep();
        return draw();
      }
      await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
    }
  };

  /** @param {EarlyPress} press @returns {Promise<number>} HTTP status; 0: no answer */
  const post = async ({ robotId, pressId, pressedAt }) => {
    const whose = robotId === null ? "fleet" : `robots/${encodeURIComponent(robotId)}`;
    try {
      const answer = await fetch(`/api/v1/${whose}/stop`, {
        method: "POST",
        headers: { "Content-Type": "application/json", "X-IVEG": "1" },
        body: JSON.stringify({ press_id: pressId, pressed_at: pressedAt }),
        // The press outlives a page that is left at once.
        keepalive: true,
        signal: AbortSignal.timeout(HTTP_LIMIT_MS),
      });
      return answer.status;
    } catch {
      return 0;
    }
  };

  /** Stores what the server has not taken, until the modules do so. */
  const keep = () => {
    if (isOver()) return;
    const open = [...presses.values()].filter(({ taken }) => !taken);
    try {
      sessionStorage.setItem(KEPT, JSON.stringify(open));
    } catch {
      // Forbidden by the browser: the press lasts as long as its page.
      isKept = false;
    }
  };

  /** Goes on with what was kept when the page before was left. */
  const goOn = () => {
    if (!document.getElementById("stops")) return;
    try {
      const kept = JSON.parse(sessionStorage.getItem(KEPT) ?? "[]");
      for (const press of kept) if (!presses.has(press.robotId)) begin(press);
    } catch {
      // Nothing that could be read.
    }
  };

  const draw = () => {
    if (isOver()) return;
    for (const press of presses.values()) drawPress(press);
  };

  /** @param {EarlyPress} press */
  const drawPress = ({ robotId, wallMs, taken }) => {
    const id = CSS.escape(robotId ?? "fleet");
    const control = document.querySelector(`#stops [data-stop="${id}"]`);
    const label = control?.querySelector(".stop__label");
    if (!control || !label) return;
    const isLate = !taken && Date.now() - wallMs > LATE_MS;
    const said = taken ? "taken" : isLate ? "late" : "heard";
    const words = String(
      document.getElementById("stops")?.getAttribute(`data-${said}`),
    );
    label.removeAttribute("data-i18n");
    control.setAttribute("data-state", isLate ? "lost" : "asked");
    control.setAttribute("aria-busy", String(!taken));
    if (label.textContent === words) return;
    label.textContent = words;
    tell(`${robotId ?? ""} ${words}`);
  };

  /** Has it read aloud. @param {string} words */
  const tell = (words) => {
    const told = document.getElementById("status-told");
    if (told) told.textContent = words;
  };

  const tellUnloaded = () => {
    const line = document.querySelector(".status__unloaded");
    if (isOver() || !line) return;
    document.body.toggleAttribute("data-unloaded", true);
    tell(String(line.textContent));
  };

  /** The STOP control that an event is of. @param {Event} event */
  const idOf = ({ target }) =>
    target instanceof Element
      ? target.closest("[data-stop]")?.getAttribute("data-stop")
      : undefined;

  /** @param {PointerEvent} event */
  const onPointerDown = (event) => {
    const id = idOf(event);
    if (isOver() || !id || event.button !== 0) return;
    isGesture = true;
    hear(id);
  };

  /** The click of a gesture that was heard is no other press. @param {MouseEvent} event */
  const onClick = (event) => {
    const id = idOf(event);
    if (!id) return onMore(event);
    if (isGesture) event.stopImmediatePropagation();
    else if (!isOver()) hear(id);
    isGesture = false;
  };

  /** Shows the controls of a large fleet, as `panels/dialogs.js` does. @param {Event} event */
  const onMore = ({ target }) => {
    const more = target instanceof Element && target.closest("#stops-more");
    if (isOver() || !more) return;
    const isOpen = document.getElementById("stops")?.toggleAttribute("data-open");
    more.setAttribute("aria-expanded", String(isOpen));
  };

  const onPointerEnd = () => {
    setTimeout(() => {
      isGesture = false;
    }, GESTURE_MS);
  };

  /** @param {KeyboardEvent} event */
  const onKeyDown = (event) => {
    const isFleet = event.ctrlKey && (event.key === "." || event.code === "Period");
    const isPress = (event.key === "Enter" || event.key === " ") && !event.ctrlKey;
    const id = isFleet ? "fleet" : isPress && !event.altKey && idOf(event);
    if (isOver() || !id) return;
    event.preventDefault();
    if (!event.repeat) hear(id);
  };

  const isOfModules = (/** @type {Event} */ { target }) =>
    target instanceof HTMLScriptElement && target.type === "module";

  addEventListener("pointerdown", onPointerDown, { capture: true });
  addEventListener("pointerup", onPointerEnd, { capture: true });
  addEventListener("pointercancel", onPointerEnd, { capture: true });
  addEventListener("click", onClick, { capture: true });
  addEventListener("keydown", onKeyDown, { capture: true });
  addEventListener("error", (event) => isOfModules(event) && tellUnloaded(), true);
  setTimeout(tellUnloaded, PATIENCE_MS);
  const drawing = setInterval(() => {
    draw();
    if (isOver()) clearInterval(drawing);
  }, DRAW_MS);
  // The page is read whole by then; `DOMContentLoaded` would wait for the modules.
  document.addEventListener("readystatechange", goOn, { once: true });
}
