/**
 * The sound of an unacknowledged P1: two short tones, again and again.
 *
 * Browsers are mute until somebody has touched the page; the tone then begins by itself.
 */

const EVERY_MS = 1600;
const TONES_HZ = [880, 660];
const LENGTH_S = 0.18;
const VOLUME = 0.12;

export function createTone() {
  /** @type {AudioContext | null} */
  let context = null;
  /** @type {ReturnType<typeof setInterval> | undefined} */
  let timer;

  function play() {
    if (!navigator.userActivation?.hasBeenActive) return;
    context ??= new AudioContext();
    TONES_HZ.forEach((hertz, i) => {
      beep(/** @type {AudioContext} */ (context), hertz, i * LENGTH_S * 1.3);
    });
  }

  return {
    /** @param {boolean} isOn */
    sound(isOn) {
      if (isOn && timer === undefined) {
        play();
        timer = setInterval(play, EVERY_MS);
      } else if (!isOn) {
        clearInterval(timer);
        timer = undefined;
      }
    },
  };
}

/** @param {AudioContext} context @param {number} hertz @param {number} afterS */
function beep(context, hertz, afterS) {
  const oscillator = context.createOscillator();
  const gain = context.createGain();
  const start = context.currentTime + afterS;
  oscillator.frequency.value = hertz;
  gain.gain.setValueAtTime(VOLUME, start);
  gain.gain.linearRampToValueAtTime(0, start + LENGTH_S);
  oscillator.connect(gain).connect(context.destination);
  oscillator.start(start);
  oscillator.stop(start + LENGTH_S);
}
