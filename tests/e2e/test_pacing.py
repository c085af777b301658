"""Twenty robots before two pages that cannot keep up: facts of order, not times.

One page does something else for most of each frame; the other sits behind a line of
1 Mbit/s and 200 ms, whose queue has no end.  Either skips; neither looks into the past.
"""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Page

from iveg.web.live.feed import FRAMES
from tests.bonds import bound
from tests.browsers import sign_in
from tests.chaos.radio import Radio, Weather
from tests.e2e.reading import evaluate
from tests.fleet import names
from tests.patience import PATIENCE_MS
from tests.processes import ROOT, Site, site

pytestmark = pytest.mark.e2e

ROBOTS = names(20)
SECONDS = 3.0
FAR = Weather(late_s=0.1, bytes_per_s=125_000)

WATCH = """() => {
  const seen = {most: 0, painted: 0, frames: 0, older: [], last: {}, count: {}};
  const Native = WebSocket;
  window.seen = seen;
  window.WebSocket = class extends Native {
    constructor(...words) {
      super(...words);
      seen.painted = 0;
      this.addEventListener('message', ({data}) => {
        if (!(data instanceof ArrayBuffer)) return;
        const size = new DataView(data).getUint32(0, true);
        const head = new TextDecoder().decode(new Uint8Array(data, 4, size));
        seen.frames = JSON.parse(head).frame;
        seen.most = Math.max(seen.most, seen.frames - seen.painted);
      });
    }
    send(words) {
      const said = JSON.parse(words);
      if (said.type === 'painted') seen.painted = said.frame;
      super.send(words);
    }
  };
  window.__onPaint = ({robot, kind, stamp}) => {
    const key = `${robot} ${kind}`;
    if (seen.last[key] > stamp) seen.older.push([key, seen.last[key], stamp]);
    seen.last[key] = stamp;
    seen.count[key] = (seen.count[key] ?? 0) + 1;
  };
}"""

BUSY = """() => {
  // Of the clock, not of the processor: as much in a crowd of other programs.
  const draw = () => {
    const over = performance.now() + 60;
    while (performance.now() < over);
    requestAnimationFrame(draw);
  };
  requestAnimationFrame(draw);
}"""

ALL_PAINTED = """([robots, frames]) => {
  if (window.seen.frames <= frames) return false;
  const painted = Object.entries(window.seen.count);
  return painted.filter(([key, n]) => key.endsWith('odom') && n > 2).length === robots;
}"""


@pytest.fixture(scope="module")
def crowd(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server for twenty robots in an open field, all of them talking."""
    settings = {"IVEG_ROBOTS": ",".join(ROBOTS), "IVEG_GREENHOUSE": "none"}
    with site(tmp_path_factory.mktemp("crowd"), **settings) as place:
        place.start("fiware").wait_until_ready()
        place.start("serve")
        place.wait_until_whole()
        port = urlsplit(place.settings["IVEG_MQTT_URL"]).port
        words = ["--port", str(port), "--robots", "20", "--hz", "2", "--beams", "360"]
        talking = bound(sys.executable, "-m", "tests.fleet", *words)
        fleet = subprocess.Popen(talking, cwd=ROOT)
        yield place
        fleet.terminate()
        fleet.wait(10)


def test_nothing_older_than_its_successor_is_painted_and_the_window_holds(
    browser: Browser, crowd: Site
) -> None:
    # One after the other: a server that answers no probe of theirs in 0.9 s, as where
    # all of them and other tests share two cores, is lost to both.
    seen = []
    with Radio(int(crowd.settings["IVEG_PORT"])) as line:
        line.weather = FAR
        far = f"http://127.0.0.1:{line.port}"
        for url, scripts in (far, [WATCH]), (crowd.url, [WATCH, BUSY]):
            with _opened(browser, crowd, url, *scripts) as page:
                page.wait_for_timeout(1000 * SECONDS)
                page.wait_for_function(
                    ALL_PAINTED, arg=[len(ROBOTS), FRAMES], timeout=PATIENCE_MS
                )
                seen.append(evaluate(page, "() => window.seen"))

    for told in seen:
        assert told["older"] == []
        assert 0 < told["most"] <= FRAMES
        assert told["frames"] > FRAMES


@contextmanager
def _opened(browser: Browser, place: Site, url: str, *scripts: str) -> Iterator[Page]:
    with browser.new_context() as context:
        context.add_init_script(";".join(f"({script})()" for script in scripts))
        page = context.new_page()
        sign_in(context, place)
        # A long line.
        page.goto(url, timeout=90_000)
        yield page
