"""From a robot's stamp to pixels, with 2, 10 and 20 robots: iVeg beside a plain relay.

The same fleet (``tests.fleet``: odometry, a scan of 720 ranges and four boxes a robot
at 30 Hz) talks to either, in turns, in the same Chromium.  *Calm*: each robot sees one
person; *storm*: no two looks are alike.  Ages are taken from the robot's stamp in the
animation frame that drew it; both clocks are this machine's.

    python -m benchmarks.glass --robots 2,10,20 --scenes calm,storm --seconds 10
    python -m benchmarks.glass --robots 20 --direct off
    python -m benchmarks.glass --robots 10 --pages 5
    python -m benchmarks.glass --robots 10 --elsewhere 4
    python -m benchmarks.glass --robots 50 --hz 10

prints a table and leaves ``test-output/glass.json`` and ``glass.html``.
"""

import argparse
import itertools
import json
import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from urllib.parse import urlsplit

from playwright.sync_api import Browser, CDPSession

from benchmarks.process import Usage, machine, percentile, print_table
from tests.brokers import MOSQUITTO, PLAIN
from tests.browsers import running_browser
from tests.fleet import names
from tests.ports import free_ports
from tests.processes import ROOT, Site, children_of, site, until

SIDES = ("relay", "iveg")
SENSORS, LATE_MS = 3, 100.0
WARM_UP_S = 10.0
APIKEY = "glass"

WATCH = """() => {
  window.painted = [];
  window.__onPaint = ({robot, kind, stamp}) => {
    if (kind !== 'odom') return;
    const now = performance.timeOrigin + performance.now();
    const micros = Number(stamp.slice(20, -1).padEnd(6, '0'));
    const sent = Date.parse(stamp.slice(0, 19) + 'Z') + micros / 1000;
    window.painted.push([robot, sent, now]);
  };
}"""


@dataclass(frozen=True, slots=True)
class Run:
    """What one side did with one fleet.

    Attributes:
        ages_ms: Of every odometry that was painted, when it was.
        late_share: Of the time, that a robot's next odometry had been sent more than
            100 ms ago and was not painted yet.
        cpu_per_1k: Processor seconds for 1,000 messages sent, of the servers that
            count together: the relay with its broker, or ``serve``.
        fiware_per_1k: The same of ``fiware``, which has the broker; 0 for the relay.
        main_ms_per_s: What the page's main thread was busy.
    """

    side: str
    robots: int
    scene: str
    ages_ms: list[float]
    late_share: float
    cpu_per_1k: float
    fiware_per_1k: float
    main_ms_per_s: float
    load: float

    def age(self, share: float) -> float:
        """That share of the painted odometry was younger (ms)."""
        return percentile(sorted(self.ages_ms), share) if self.ages_ms else float("nan")


def main() -> None:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", default="2,10,20")
    parser.add_argument("--scenes", default="calm,storm")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--sides", default=",".join(SIDES))
    parser.add_argument("--out", type=Path, default=ROOT / "test-output")
    parser.add_argument("--hz", type=float, default=30.0)
    parser.add_argument("--pages", type=int, default=1, help="open side by side")
    parser.add_argument(
        "--elsewhere", type=int, default=0, help="pages that draw on other machines"
    )
    parser.add_argument("--direct", default="all", help="IVEG_DIRECT_READ")
    asked, _ = parser.parse_known_args()
    how = How(asked.seconds, asked.hz, asked.pages, asked.elsewhere, asked.direct)
    turns = itertools.product(
        asked.scenes.split(","),
        map(int, asked.robots.split(",")),
        asked.sides.split(",") * asked.rounds,
    )
    with running_browser() as browser:
        runs = [
            measure(browser, side, robots, scene, how) for scene, robots, side in turns
        ]
    report(runs)
    asked.out.mkdir(parents=True, exist_ok=True)
    told = json.dumps([asdict(run) for run in runs])
    (asked.out / "glass.json").write_text(told)
    draw(runs, asked.out / "glass.html")


# --- one run --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class How:
    """What all runs of a call have in common.

    Attributes:
        seconds: Of measuring.
        hz: Of each sensor.
        pages: Open side by side; the first is measured.
        elsewhere: Readers beside them (``benchmarks.readers``).
        direct: What iVeg reads straight from the broker.
    """

    seconds: float
    hz: float
    pages: int
    elsewhere: int
    direct: str


@dataclass(frozen=True, slots=True)
class Place:
    """Where a side listens, and what it costs."""

    link: str
    mqtt: int
    servers: list[int]
    fiware: list[int]


def measure(browser: Browser, side: str, robots: int, scene: str, how: How) -> Run:
    """One side, one fleet."""
    serving = iveg_side if side == "iveg" else _relay
    seconds = how.seconds
    with (
        tempfile.TemporaryDirectory() as directory,
        serving(Path(directory), robots, how.direct) as place,
        talking_fleet(place, robots, scene, how.hz),
        _readers(place, how.elsewhere),
    ):
        context = browser.new_context(viewport={"width": 1280, "height": 900})
        page = context.new_page()
        page.goto(place.link)
        # The page of the link posts its token, and goes on.
        page.wait_for_url(lambda url: "/signin" not in url)
        for _ in range(how.pages - 1):
            context.new_page().goto(page.url)
        page.bring_to_front()
        page.wait_for_timeout(1000 * WARM_UP_S)
        tools = context.new_cdp_session(page)
        tools.send("Performance.enable")
        before = spent(place.servers), spent(place.fiware), _busy_s(tools)
        page.evaluate(WATCH)
        page.wait_for_timeout(1000 * seconds)
        painted = page.evaluate("() => window.painted")
        after = spent(place.servers), spent(place.fiware), _busy_s(tools)
        context.close()
    took = [now - then for now, then in zip(after, before, strict=True)]
    sent = how.hz * SENSORS * robots * seconds
    return Run(
        side,
        robots,
        scene,
        [now - stamp for _, stamp, now in painted],
        late_share(painted, robots, how),
        1000.0 * took[0] / sent,
        1000.0 * took[1] / sent,
        1000.0 * took[2] / seconds,
        os.getloadavg()[0],
    )


def late_share(
    painted: Sequence[tuple[str, float, float]], robots: int, how: How
) -> float:
    """The share of time in which a robot's next odometry was late by 100 ms."""
    late_ms = 0.0
    for robot in {one[0] for one in painted}:
        mine = [(stamp, now) for name, stamp, now in painted if name == robot]
        for (stamp, shown), (_, now) in itertools.pairwise(mine):
            due = stamp + 1000.0 / how.hz + LATE_MS
            late_ms += max(0.0, now - max(shown, due))
    unseen = robots - len({one[0] for one in painted})
    return (late_ms / (1000.0 * how.seconds) + unseen) / robots


@contextmanager
def iveg_side(
    directory: Path, robots: int, direct: str = "all", recordings: str = "off"
) -> Iterator[Place]:
    """A running iVeg for a fleet of so many robots."""
    settings = {
        "IVEG_RECORDINGS": recordings,
        "IVEG_ROBOTS": ",".join(names(robots)),
        "IVEG_GREENHOUSE": "none",
        "IVEG_APIKEY": APIKEY,
        "IVEG_DIRECT_READ": direct,
    }
    with site(directory, **settings) as there:
        demo = there.start("demo", "--no-emulator")
        there.wait_until_whole()
        parts = children_of(demo.pid)
        fiware = [one for one in parts if "fiware" in words_of(one)]
        serve = [one for one in parts if one not in fiware]
        yield Place(there.printed_link, _mqtt_port(there), serve, fiware)


def words_of(pid: int) -> list[str]:
    """The command line of a process."""
    return Path(f"/proc/{pid}/cmdline").read_text().split("\0")


def _mqtt_port(there: Site) -> int:
    return urlsplit(there.settings["IVEG_MQTT_URL"]).port or 1883


@contextmanager
def _relay(directory: Path, _: int, __: str) -> Iterator[Place]:
    mqtt, http = free_ports(2)
    conf = directory / "mosquitto.conf"
    conf.write_text(PLAIN.format(port=mqtt) + "max_queued_messages 0\n")
    words = "--port", str(http), "--log-level", "warning"
    environment = {"RELAY_MQTT_PORT": str(mqtt), "RELAY_APIKEY": APIKEY}
    relay = [sys.executable, "-m", "uvicorn", "benchmarks.relay:app", *words]
    with (
        _program([MOSQUITTO or "mosquitto", "-c", str(conf)]) as broker,
        _program(relay, environment) as server,
    ):
        link = f"http://127.0.0.1:{http}/"
        until(lambda: _answers(link), "the relay")
        yield Place(link, mqtt, [broker, server], [])


@contextmanager
def talking_fleet(place: Place, robots: int, scene: str, hz: float) -> Iterator[None]:
    """Robots that talk to a side."""
    words = ["--port", str(place.mqtt), "--robots", str(robots), "--hz", str(hz)]
    words += ["--apikey", APIKEY, "--scene", scene]
    with _program([sys.executable, "-m", "tests.fleet", *words]):
        yield


@contextmanager
def _readers(place: Place, pages: int) -> Iterator[None]:
    words = ["--link", place.link, "--pages", str(pages)]
    with _program([sys.executable, "-m", "benchmarks.readers", *words]):
        yield


@contextmanager
def _program(
    words: Sequence[str], environment: Mapping[str, str] | None = None
) -> Iterator[int]:
    process = subprocess.Popen(
        words, cwd=ROOT, env={**os.environ, **(environment or {})}
    )
    try:
        yield process.pid
    finally:
        process.terminate()
        process.wait(10)


def _answers(link: str) -> bool:
    address = urlsplit(link)
    with socket.socket() as probe:
        return probe.connect_ex((address.hostname or "", address.port or 0)) == 0


def spent(pids: Sequence[int]) -> float:
    """Their processor time since their start (s)."""
    return sum(Usage.of(one).cpu_s for one in pids)


def _busy_s(tools: CDPSession) -> float:
    told = tools.send("Performance.getMetrics")["metrics"]
    return float({one["name"]: one["value"] for one in told}["TaskDuration"])


# --- the report -----------------------------------------------------------------------

FIGURES = {
    "P50 ms": lambda run: run.age(0.50),
    "P95 ms": lambda run: run.age(0.95),
    "late %": lambda run: 100.0 * run.late_share,
    "CPU s/1k": lambda run: run.cpu_per_1k,
    "fiware s/1k": lambda run: run.fiware_per_1k,
    "main ms/s": lambda run: run.main_ms_per_s,
}


CPUS = 3, 4
"""Both are compared with what the relay and its broker take."""


def report(runs: Sequence[Run]) -> None:
    """Medians of the rounds, and iVeg divided by the relay."""
    rows = []
    for scene, robots in dict.fromkeys((run.scene, run.robots) for run in runs):
        told = {}
        for side in SIDES:
            mine = [
                run
                for run in runs
                if (run.scene, run.robots, run.side) == (scene, robots, side)
            ]
            if not mine:
                continue
            told[side] = [median(map(of, mine)) for of in FIGURES.values()]
            rows.append(
                [scene, str(robots), side, *(f"{one:.2f}" for one in told[side])]
            )
        if len(told) == len(SIDES):
            relay = told["relay"]
            relay[CPUS[1]] = relay[CPUS[0]]
            ratios = zip(told["iveg"], relay, strict=True)
            cells = (f"{ours / its:.2f}" if its else "-" for ours, its in ratios)
            rows.append([scene, str(robots), "ratio", *cells])
    head = ["scene", "robots", "page", *FIGURES]
    print_table(f"Odometry: stamp → painted ({machine()})", head, rows)


def draw(runs: Sequence[Run], file: Path) -> None:
    """One box a run, on a scale of powers."""
    from plotly.graph_objects import Box, Figure

    figure = Figure()
    for side in SIDES:
        mine = [run for run in runs if run.side == side]
        figure.add_trace(
            Box(
                name=side,
                x=[f"{run.robots} {run.scene}" for run in mine for _ in run.ages_ms],
                y=[age for run in mine for age in run.ages_ms],
                boxpoints=False,
            )
        )
    figure.update_layout(
        title="Odometry: stamp → painted (ms)", boxmode="group", yaxis_type="log"
    )
    figure.write_html(file)


if __name__ == "__main__":
    main()
