"""How soon any second of the past is on the screen, beside a server that records.

    python -m benchmarks.past_cost --robots 10 --hz 30 --record 120 --asked 40

A real server records a fleet that talks.  A finished hour and 22 shorter files are
made of what it recorded so far: the same messages under earlier times, so that the
number of files and the size of one are those of a day; seconds are asked for where a
file holds what was recorded then.  Half of them are in the file that is being written.

*ready*: by a new viewer, for whom a process stands ready.  *none ready*: by another at
once.  *next*: by the same, anywhere.  *page*: from the address to the cards of robots.
CPU is of the viewer's process: it differs less with what else the machine does.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random

import httpx
from playwright.sync_api import Browser

from benchmarks.glass import APIKEY, Place, talking_fleet, words_of
from benchmarks.process import Usage, machine, pause, percentile, print_table
from iveg.adapters.recordings.mcap_file import McapFile
from iveg.adapters.recordings.reading import RecordedMessage, read_messages
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from tests.browsers import running_browser
from tests.fleet import names
from tests.processes import Site, children_of, site

HEAD = ("question", "n", "P50 s", "P95 s", "CPU P50 s", "CPU P95 s", "failed")
HOURS = 24
EVERY_S = 11.0
"""Between two that come anew: a viewer is in use for ten seconds after a question."""
_HOUR_S, _NS = 3600.0, 10**9
_EDGE_S = 8.0
"""At both ends of a file something may be missing, such as the first memory."""
_WHOLE = """() => document.querySelector('.card[data-mode]') && performance.now()"""


class Asked:
    """Answers to one kind of question."""

    def __init__(self) -> None:
        self.took_s: list[float] = []
        self.cpu_s: list[float] = []
        self.failed = 0

    def row(self, name: str) -> list[str]:
        """Of the table."""
        told = [
            f"{percentile(sorted(values) or [float('nan')], share):.2f}"
            for values in (self.took_s, self.cpu_s)
            for share in (0.5, 0.95)
        ]
        return [name, str(len(self.took_s)), *told, str(self.failed)]


def main() -> None:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--hz", type=float, default=30.0)
    parser.add_argument("--record", type=float, default=120.0, help="at first (s)")
    parser.add_argument("--asked", type=int, default=40)
    parser.add_argument("--hour", type=float, default=3600.0, help="of that (s)")
    parser.add_argument("--scene", default="calm")
    asked = parser.parse_args()
    settings = {
        "IVEG_RECORDINGS": "on",
        "IVEG_ROBOTS": ",".join(names(asked.robots)),
        "IVEG_GREENHOUSE": "none",
        "IVEG_APIKEY": APIKEY,
    }
    with (
        tempfile.TemporaryDirectory() as name,
        site(Path(name), **settings) as there,
        running_browser() as browser,
    ):
        demo = there.start("demo", "--no-emulator")
        there.wait_until_whole()
        port = int(there.settings["IVEG_MQTT_URL"].rpartition(":")[2])
        place = Place(there.sign_in_link, port, [], [])
        with talking_fleet(place, asked.robots, asked.scene, asked.hz):
            pause(asked.record)
            folder = next(Path(name).rglob("*.mcap.open")).parent
            day = _Day(folder, asked.hour)
            _report(there, browser, day, asked.asked, demo.pid)


class _Day:
    """Recordings of a day, of which one is being written.

    Args:
        hour_s: Length of the one that stands for a whole hour (s).
    """

    def __init__(self, folder: Path, hour_s: float) -> None:
        (self._written,) = folder.glob("*.mcap.open")
        with read_messages(self._written) as reading:
            self._start = reading.start
            messages = list(reading)
        self._length_s = (messages[-1][1] - messages[0][1]) / _NS
        for hour in range(1, HOURS):
            self._make(folder, hour, messages, hour_s if hour == 1 else 0.0)
        sizes = [one.stat().st_size for one in folder.glob("*.mcap*")]
        print(
            f"{len(sizes)} files, {sum(sizes) / 1e9:.2f} GB, of which a whole hour"
            f" {max(sizes) / 1e9:.2f} GB; of {self._length_s:.0f} s"
        )

    def moments(self, rnd: Random) -> Iterator[float]:
        """Unix seconds without end, every other one in the file that is written."""
        while True:
            since = self._start.wall
            yield rnd.uniform(since + _EDGE_S, time.time() - _EDGE_S)
            hour = rnd.choice((1, rnd.randrange(2, HOURS)))
            ends = since - hour * _HOUR_S + self._length_s
            yield rnd.uniform(ends - self._length_s + _EDGE_S, ends - _EDGE_S)

    def _make(
        self, folder: Path, hour: int, messages: list[RecordedMessage], before_s: float
    ) -> None:
        """A file of what was recorded, as of so many hours ago.

        The same comes for ``before_s`` before it, under the wrong moments: it is to be
        passed over.
        """
        turns = int(before_s / self._length_s)
        length = round(self._length_s * _NS)
        begun = self._start.later(-turns * self._length_s)
        start = Instant(begun.mono, begun.wall - hour * _HOUR_S)
        stem = format_stamp(start.wall)[: len("2026-11-24T10:00:00")]
        path = folder / f"{stem.replace(':', '-')}Z.mcap"
        file = McapFile(path.with_suffix(".making"), start)
        for turn in range(turns, -1, -1):
            shift = turn * length + round(hour * _HOUR_S * _NS)
            for channel, log_time, payload in messages:
                file.add_at(channel, log_time - shift, payload)
        file.finish()
        file.path.rename(path)


def _report(there: Site, browser: Browser, day: _Day, count: int, pid: int) -> None:
    moments = day.moments(Random(7))  # noqa: S311 - repeatable on purpose
    told = {name: Asked() for name in ("ready", "none ready", "next", "page")}
    with there.api() as api:
        for number in range(count):
            pause(EVERY_S)
            for name in ("ready", "none ready"):
                _ask(api, told[name], next(moments), f"{name[0]}-{number}", pid)
            _ask(api, told["next"], next(moments), f"r-{number}", pid)
    _print(told)
    context = browser.new_context()
    page = context.new_page()
    page.goto(there.sign_in_link)
    for _ in range(count):
        pause(EVERY_S)
        page.goto(f"{there.url}/?t={format_stamp(next(moments))}")
        found = page.wait_for_function(_WHOLE, timeout=60_000)
        told["page"].took_s.append(found.json_value() / 1000.0)
    context.close()
    _print(told)


def _print(told: dict[str, Asked]) -> None:
    rows = [asked.row(name) for name, asked in told.items()]
    print_table(f"First picture; {machine()}", HEAD, rows)


def _ask(api: httpx.Client, to: Asked, wall: float, viewer: str, pid: int) -> None:
    before = _workers(pid)
    began = time.monotonic()
    asked = {"at": format_stamp(wall), "viewer": viewer}
    answer = api.get("world", params=asked)
    to.took_s.append(time.monotonic() - began)
    # The next one, which begins at once, takes less meanwhile.
    after = _workers(pid).items()
    to.cpu_s.append(max(cpu - before.get(one, 0.0) for one, cpu in after))
    if answer.status_code != 200:
        to.failed += 1
        print(answer.status_code, answer.text[:200])


def _workers(pid: int) -> dict[int, float]:
    """Processor time of the server's processes for others (s), by their ids."""
    found = [one for one in children_of(pid) if "-c" in words_of(one)]
    return {one: Usage.of(one).cpu_s for one in found}


if __name__ == "__main__":
    main()
