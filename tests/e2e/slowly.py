"""Pages that draw ten times a second, for tests that are about something else.

Without a graphics card a picture is computed: a live page at sixty pictures a second
takes half a processor, and the server answers each of them.
"""

from playwright.sync_api import BrowserContext

PICTURES_HZ = 10

_SCRIPT = """(() => {
  const gapMs = 1000 / PICTURES_HZ;
  const native = window.requestAnimationFrame.bind(window);
  const waiting = new Map();
  let asked = 0;
  let isComing = false;
  let last = -gapMs;
  const draw = (now) => {
    isComing = false;
    last = performance.now();
    const due = [...waiting.values()];
    waiting.clear();
    for (const callback of due) callback(now);
  };
  window.requestAnimationFrame = (callback) => {
    asked += 1;
    waiting.set(asked, callback);
    if (!isComing) {
      isComing = true;
      const restMs = last + gapMs - performance.now();
      if (restMs > 0) setTimeout(() => native(draw), restMs);
      else native(draw);
    }
    return asked;
  };
  window.cancelAnimationFrame = (number) => void waiting.delete(number);
})()""".replace("PICTURES_HZ", str(PICTURES_HZ))


def draw_slowly(context: BrowserContext) -> None:
    """Let all pages of a context that open from now on draw ten times a second."""
    context.add_init_script(_SCRIPT)
