/**
 * The sound of alerts: a P1 again and again until acknowledged, the others once.
 *
 * Browsers are mute until the page was touched; the tone then begins by itself.
 * Only the single chime can be switched off, and that is remembered; a P1 cannot.
 *
 * @typedef {ReturnType<typeof createTone>} Tone
 * @typedef {(hertz: number, afterS: number) => void} Beep
 */

import { whenResting } from "../core/rest.js";
import { browserStorage } from "../map/layers/memory.js";

const EVERY_MS = 1600;
const TONES_HZ = [880, 660];
const CHIME_HZ = [520];
const LENGTH_S = 0.18;
const VOLUME = 0.12;
const KEY = "iveg.chime";

/**
 * @param {{beep?: Beep, canSound?: () => boolean, storage?: Storage | null}} [options]
 *   tests pass their own
 */
export function createTone(options = {}) {
  const { canSound = wasTouched, storage = browserStorage() } = options;
  const beep = options.beep ?? createBeep(openWhenTouched());
  /** @type {ReturnType<typeof setInterval> | undefined} */
  let timer;
  let chimes = storage?.getItem(KEY) !== "off";

  /** @param {number[]} tones */
  function play(tones) {
    if (!canSound()) return false;
    tones.forEach((hertz, i) => {
      beep(hertz, i * LENGTH_S * 1.3);
    });
    return true;
  }

  return {
    /** Whether a P1 waits for its acknowledgement. @param {boolean} isOn */
    sound(isOn) {
      if (isOn && timer === undefined) {
        play(TONES_HZ);
        timer = setInterval(() => play(TONES_HZ), EVERY_MS);
      } else if (!isOn) {
        clearInterval(timer);
        timer = undefined;
      }
    },
    isSounding: () => timer !== undefined,
    /** One alert of lower priority has come. */
    chime: () => chimes && play(CHIME_HZ),
    /** Sounds like a P1, once; returns whether the browser allows it. */
    test: () => play(TONES_HZ),
    canSound,
    hasChimes: () => chimes,
    /** @param {boolean} isOn */
    setChimes(isOn) {
      chimes = isOn;
      try {
        storage?.setItem(KEY, isOn ? "on" : "off");
      } catch {
        // A full or forbidden storage costs the memory of a switch, never the switch.
      }
    },
  };
}

function wasTouched() {
  return navigator.userActivation?.hasBeenActive ?? true;
}

/** @param {() => AudioContext} open @returns {Beep} */
function createBeep(open) {
  return (hertz, afterS) => {
    const context = open();
    context.resume();
    const oscillator = context.createOscillator();
    const gain = context.createGain();
    const start = context.currentTime + afterS;
    oscillator.frequency.value = hertz;
    gain.gain.setValueAtTime(VOLUME, start);
    gain.gain.linearRampToValueAtTime(0, start + LENGTH_S);
    oscillator.connect(gain).connect(context.destination);
    oscillator.start(start);
    oscillator.stop(start + LENGTH_S);
  };
}

/**
 * The browser's audio, started once the page was touched and rests.
 *
 * The first one starts a service of the browser and holds up the page meanwhile: for
 * seconds on a busy machine, and not when a P1 has just come.
 */
export function openWhenTouched(make = () => new AudioContext(), page = globalThis) {
  /** @type {AudioContext | null} */
  let context = null;
  const open = () => {
    context ??= make();
    return context;
  };
  for (const touch of ["click", "keydown"])
    page.addEventListener(
      touch,
      async () => {
        await whenResting();
        if (!context) await open().suspend();
      },
      { once: true },
    );
  return open;
}
