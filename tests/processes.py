"""iVeg's own programs, run as a user runs them: processes, ports, signals, logs."""

import os
import re
import secrets
import signal
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, TypeVar

import httpx

from tests.bonds import bound
from tests.forge import PROGRAMS, Forked, fork
from tests.patience import PATIENCE_S
from tests.ports import free_ports

ROOT = Path(__file__).resolve().parents[1]
_DIRTY = re.compile(r"^.*(?:\b(?:WARNING|ERROR|CRITICAL)\b|Traceback).*$", re.MULTILINE)
_BUSY = re.compile("answers take|reads too slowly: oldest dropped|has caught up")
"""Slow answers, and notifications read too slowly, are true of a busy machine."""
_READY = re.compile(r"^ready$", re.MULTILINE)
_STOP_WITHIN_S = 30.0
EMULATOR = ("emulator", "--hz", "10")
"""Robots for tests that are not about speed: a third as often as they would speak, so
that several stacks and browsers have room on one machine."""

NO_TLS = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
"""For clients of programs here: to read certificates takes 25 ms of a processor each
time, and somebody asks again and again."""

T = TypeVar("T")


def until(probe: Callable[[], T | None], what: str, within_s: float = PATIENCE_S) -> T:
    """Ask again and again until the answer is true; the answer.

    Raises:
        AssertionError: none came within ``within_s``; says ``what`` was missing.
    """
    pause = threading.Event()
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        if answer := probe():
            return answer
        pause.wait(0.05)
    raise AssertionError(f"not within {within_s:g} s: {what}")


@dataclass
class Program:
    """One ``python -m iveg WORD …``, its output in a file."""

    words: tuple[str, ...]
    process: subprocess.Popen[bytes] | Forked
    log: Path

    @property
    def pid(self) -> int:
        return self.process.pid

    def text(self) -> str:
        """All it said so far."""
        return self.log.read_text(errors="replace")

    def wait_until_ready(self) -> None:
        """Until it says so; a program that has ended never will."""

        def is_ready() -> bool:
            assert self.process.poll() is None, self.text()
            return _READY.search(self.text()) is not None

        until(is_ready, f"{self.words[0]} is ready")

    def complaints(self) -> list[str]:
        """Lines that a clean run does not have, on a machine as busy as it may be."""
        dirty = _DIRTY.findall(self.text())
        return [line for line in dirty if _BUSY.search(line) is None]

    def interrupt(self) -> int:
        """What Ctrl-C does; returns the exit status."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return self.process.wait(_STOP_WITHIN_S)

    def kill(self) -> None:
        """What a power cut does."""
        self.process.kill()
        self.process.wait(_STOP_WITHIN_S)


@dataclass
class Site:
    """A place of its own for one iVeg: ports, secrets, data directory."""

    directory: Path
    settings: dict[str, str] = field(default_factory=dict)
    programs: list[Program] = field(default_factory=list)

    def __post_init__(self) -> None:
        page, mqtt, orion, iota = free_ports(4)
        self.settings = {
            "IVEG_HOST": "127.0.0.1",
            "IVEG_PORT": str(page),
            "IVEG_MQTT_URL": f"mqtt://127.0.0.1:{mqtt}",
            "IVEG_ORION_URL": f"http://127.0.0.1:{orion}",
            "IVEG_IOTA_URL": f"http://127.0.0.1:{iota}",
            "IVEG_NOTIFY_URL": f"http://127.0.0.1:{page}/ngsi/notifications",
            "IVEG_NOTIFY_TOKEN": secrets.token_hex(32),
            "IVEG_DATABASE_URL": f"sqlite:///{self.directory / 'history.sqlite'}",
            "IVEG_SIGN_IN_TOKEN": secrets.token_hex(16),
            "IVEG_API_TOKEN": secrets.token_urlsafe(24),
            "IVEG_RECORDINGS": "off",
            "IVEG_KEEP_RECORDINGS_GB": "1",
            "IVEG_KEEP_PICTURES_GB": "1",
            "XDG_DATA_HOME": str(self.directory),
            **self.settings,
        }

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://127.0.0.1:{self.settings['IVEG_PORT']}"

    @property
    def printed_link(self) -> str:
        """What a grower opens first."""
        return f"{self.url}/signin#token={self.settings['IVEG_SIGN_IN_TOKEN']}"

    @property
    def proof(self) -> dict[str, str]:
        """Body of ``POST /signin`` by which the link's page signs in."""
        return {"token": self.settings["IVEG_SIGN_IN_TOKEN"]}

    @property
    def own_page(self) -> dict[str, str]:
        """Headers of a request that a page of this server sends."""
        return {"X-IVEG": "1", "Origin": self.url}

    def start(self, *words: str, module: str = "iveg") -> Program:
        """Start ``python -m iveg WORD …`` here, or another module."""
        if words[0] == "serve":
            # Loads Alembic, which who only wants a path from here does not need.
            from tests.databases import lay_history

            lay_history(self.settings["IVEG_DATABASE_URL"])
        log = self.directory / f"{len(self.programs)}-{words[0]}.log"
        with log.open("wb") as output:
            program = Program(words, self._begin(module, words, output), log)
        self.programs.append(program)
        return program

    def _begin(
        self, module: str, words: tuple[str, ...], output: BinaryIO
    ) -> subprocess.Popen[bytes] | Forked:
        environment = self._environment()
        if sys.platform == "linux" and module == "iveg" and words[0] in PROGRAMS:
            return fork(words, self.directory, environment, output.fileno())
        return subprocess.Popen(
            bound(sys.executable, "-m", module, *words),
            cwd=self.directory,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            # Ctrl-C in the terminal of the tests is not Ctrl-C here.
            start_new_session=True,
        )

    def _environment(self) -> Mapping[str, str]:
        inherited = ("PATH", "HOME", "LANG", "SYSTEMROOT", "TMPDIR")
        kept = {name: os.environ[name] for name in inherited if name in os.environ}
        return {
            **kept,
            "PYTHONPATH": str(ROOT),
            "PYTHONUNBUFFERED": "1",
            **self.settings,
        }

    def api(self) -> httpx.Client:
        """A program's view of the API: may read and stop."""
        bearer = {"Authorization": f"Bearer {self.settings['IVEG_API_TOKEN']}"}
        return httpx.Client(
            base_url=f"{self.url}/api/v1/",
            headers=bearer,
            timeout=30.0,
            trust_env=False,
            verify=NO_TLS,
        )

    def serve(self) -> None:
        """FIWARE and the dashboard run, and the page answers."""
        self.start("fiware").wait_until_ready()
        self.start("serve")
        self.wait_until_served()

    def wait_until_served(self) -> None:
        """Until the page answers."""
        until(lambda: _answers(f"{self.url}/healthz"), "/healthz")

    def wait_until_live(self, robots: int = 2) -> None:
        """Until that many robots are LIVE."""
        self.wait_until_served()
        with self.api() as api:
            until(lambda: _live(api) >= robots, f"{robots} robots LIVE")

    def wait_until_whole(self) -> None:
        """Until a measure of iVeg's own has passed every hop of FIWARE.

        The agent makes up an entity for a device that it has not been told of yet.
        """
        self.wait_until_served()
        with self.api() as api:
            until(lambda: _is_whole(api), "FIWARE passes measures on")

    def newest(self, word: str) -> Program:
        """The program of this word that was started last."""
        return [one for one in self.programs if one.words[0] == word][-1]

    @contextmanager
    def paused(self, word: str) -> Iterator[None]:
        """A program that is there and does nothing."""
        process = self.newest(word).process
        process.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            process.send_signal(signal.SIGCONT)

    def stop_all(self) -> None:
        """Ctrl-C for what still runs, last started first; a kill where that hangs."""
        for program in reversed(self.programs):
            if program.process.poll() is None:
                try:
                    program.interrupt()
                except subprocess.TimeoutExpired:
                    program.kill()

    def assert_clean(self) -> None:
        """No program said anything that a clean run does not say."""
        said = {p.log.name: p.complaints() for p in self.programs if p.complaints()}
        assert said == {}


@contextmanager
def site(directory: Path, **settings: str) -> Iterator[Site]:
    """A place of its own that is cleared up afterwards."""
    place = Site(directory, settings)
    try:
        yield place
    finally:
        place.stop_all()


def children_of(pid: int) -> list[int]:
    """All living descendants of a process, from ``/proc``."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        fields = _stat_fields(stat)
        if fields is not None:
            parents[int(stat.parent.name)] = int(fields[1])
    found: list[int] = []
    wanted = {pid}
    while wanted:
        wanted = {child for child, parent in parents.items() if parent in wanted}
        found += sorted(wanted)
    return found


def is_alive(pid: int) -> bool:
    """Whether a process still runs (a zombie does not)."""
    fields = _stat_fields(Path(f"/proc/{pid}/stat"))
    return fields is not None and fields[0] != "Z"


def _stat_fields(stat: Path) -> list[str] | None:
    try:
        # The name in brackets may hold spaces; what follows does not.
        return stat.read_text().rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return None


def _answers(url: str) -> bool:
    try:
        answer = httpx.get(url, timeout=5.0, trust_env=False, verify=NO_TLS)
    except httpx.TransportError:
        return False
    return answer.status_code == 200


def _is_whole(api: httpx.Client) -> bool:
    try:
        answer = api.get("health")
    except httpx.TransportError:
        return False
    hops = answer.json()["hops"] if answer.status_code == 200 else []
    wanted = {"mqtt", "orion", "iot_agent", "notifications"}
    return wanted <= {hop["hop"] for hop in hops if hop["state"] == "ok"}


def _live(api: httpx.Client) -> int:
    try:
        answer = api.get("robots")
    except httpx.TransportError:
        return 0
    if answer.status_code != 200:
        return 0
    return sum(robot["link"] == "LIVE" for robot in answer.json()["items"])
