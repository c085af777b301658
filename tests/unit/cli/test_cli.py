"""Words and settings become parts, or one clear sentence and an exit code."""

import io
import socket
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Literal, get_type_hints

import pytest

from iveg import __version__
from iveg.adapters import clock
from iveg.adapters.history.store import Store
from iveg.cli import COMMANDS, UNUSABLE, main
from iveg.cli.arguments import CommandCall, CommandWord
from iveg.cli.nodes import node_settings
from iveg.cli.running import print_sign_in_link, sign_in_link
from iveg.domain.errors import SettingsError
from iveg.domain.records import Record
from iveg.lab import commands as laboratory
from iveg.lab.commands.demo import on_free_ports
from iveg.pipeline.record import Waiting
from iveg.settings import Settings, describe
from tests.fakes.records import NOON, log_record, odometry_record


@pytest.fixture(autouse=True)
def clean(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No variable of this machine, and a data directory of its own."""
    for name in Settings().to_environment():
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))


def run(arguments: Sequence[str]) -> int:
    """The exit code, also where argparse ends the process."""
    try:
        return main(arguments)
    except SystemExit as ended:
        return int(ended.code or 0)


def test_settings_prints_the_page_of_settings(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["settings"]) == 0
    assert capsys.readouterr().out == describe()


@pytest.mark.parametrize(
    "word", [*COMMANDS, *laboratory.COMMANDS], ids=lambda word: word.name
)
def test_every_command_is_run_by_its_module(word: CommandWord) -> None:
    hints = get_type_hints(import_module(word.module).run)

    assert [*hints.values()] == [CommandCall, int]


def test_version_prints_the_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"iveg {__version__}\n"


def test_a_bad_setting_stops_the_start_with_one_sentence(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("IVEG_PORT", "http")

    assert run(["serve"]) == UNUSABLE
    told = capsys.readouterr().err.splitlines()
    assert told == [
        "iveg: IVEG_PORT='http' cannot be used: it must be a port from 1 to 65535."
    ]


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["dance"],
        ["emulator", "--robots", "0"],
        ["emulator", "--robots", "101"],
        ["emulator", "--hz", "0.9"],
        ["emulator", "--hz", "61"],
        ["emulator", "--hz", "nan"],
        ["emulator", "--profile", "dream"],
        ["replay", "log.jsonl"],
        ["replay", "log.jsonl", "--robot", "AGI", "--speed", "0"],
        ["replay", "log.jsonl", "--robot", "AGI", "--pose", "AGI:1,2"],
        ["replay", "log.jsonl", "--robot", "AGI", "--pose", "AGI:1,nan,0"],
        ["replay", "log.jsonl", "--robot", "AGI", "--frame", "our map"],
        ["db"],
        ["db", "downgrade"],
        ["db", "stats", "--dry-run"],
    ],
)
def test_words_that_mean_nothing_are_refused(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == UNUSABLE
    assert "usage:" in capsys.readouterr().err


def test_a_recording_of_a_robot_outside_the_fleet_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["replay", "log.jsonl", "--robot", "AGX"]) == UNUSABLE
    assert "AGX" in capsys.readouterr().err


def test_a_pose_of_a_robot_that_is_not_played_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["replay", "log.jsonl", "--robot", "D1", "--pose", "D2:1,2,0.5"]

    assert run(words) == UNUSABLE
    assert "--pose, D2: is none of the robots" in capsys.readouterr().err


def test_nothing_is_played_as_a_live_robot_even_by_force(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["replay", "log.jsonl", "--robot", "AGI", "--force"]) == UNUSABLE
    assert "AGI:recording in IVEG_ROBOTS" in capsys.readouterr().err


def test_robots_of_recordings_may_be_named_one_by_one(
    capsys: pytest.CaptureFixture[str],
) -> None:
    one_by_one = ["--robot", "AGX", "--robot", "AGI"]

    assert run(["replay", "one.jsonl", "two.jsonl", *one_by_one]) == UNUSABLE
    assert "AGX" in capsys.readouterr().err


def test_a_recording_is_not_played_on_a_broker_elsewhere(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("IVEG_MQTT_URL", "mqtt://greenhouse.test")
    monkeypatch.setenv("IVEG_ROBOTS", "D1:recording")

    assert run(["replay", "log.jsonl", "--robot", "D1"]) == UNUSABLE
    assert "not on loopback" in capsys.readouterr().err


def test_provisioning_a_fiware_that_is_away_says_so(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("IVEG_IOTA_URL", "http://127.0.0.1:9")
    monkeypatch.setenv("IVEG_ORION_URL", "http://127.0.0.1:9")

    assert run(["provision"]) == 1
    assert "cannot be reached" in capsys.readouterr().err


def test_the_database_is_made_where_data_lives(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert run(["db", "upgrade"]) == 0
    assert (tmp_path / "iveg" / "iveg.sqlite").exists()
    assert capsys.readouterr().out == "The database is up to date.\n"


@pytest.mark.parametrize("action", ["stats", "purge", "vacuum"])
def test_a_database_that_is_not_there_is_one_sentence(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, action: str
) -> None:
    assert run(["db", action]) == 1
    said = f"there is none at {tmp_path / 'iveg' / 'iveg.sqlite'}; `iveg db upgrade`"
    assert said in capsys.readouterr().err


@pytest.fixture
def old_rows(tmp_path: Path) -> str:
    """A database where data lives, with odometry of 2023 and a line of today."""
    run(["db", "upgrade"])
    url = f"sqlite:///{tmp_path / 'iveg' / 'iveg.sqlite'}"
    store = Store(url)
    rows: list[Record] = [odometry_record(at=NOON + n) for n in range(120)]
    rows += (log_record(id=n, at=clock.wall() - n * 86400.0) for n in range(40))
    store.write([Waiting(one, n, 0.0) for n, one in enumerate(rows)])
    store.close()
    return url


def test_a_purge_is_counted_first_and_then_done(
    capsys: pytest.CaptureFixture[str], old_rows: str
) -> None:
    capsys.readouterr()

    assert run(["db", "purge", "--dry-run"]) == 0
    counted = capsys.readouterr().out
    assert run(["db", "purge"]) == 0
    done = capsys.readouterr().out
    assert run(["db", "purge"]) == 0
    again = capsys.readouterr().out

    assert "\n       120 rows of odometry before " in counted
    assert counted.endswith("Nothing was deleted.\n")
    assert "\n       120 rows of odometry before " in done
    assert "\n         0 rows of odometry before " in again
    assert "\n         0 rows of log before " in done


def test_stats_say_what_fills_the_disk(
    capsys: pytest.CaptureFixture[str], old_rows: str
) -> None:
    capsys.readouterr()

    assert run(["db", "stats"]) == 0
    head, *lines, hours = capsys.readouterr().out.splitlines()
    told = {line.split()[0]: line.split()[1:] for line in lines}

    assert head.split()[:3] == ["table", "rows", "MB"]
    rows, _, *ages, _ = told["odometry"]
    assert rows == "120"
    assert ages == ["2023-11-14T22:13:20.000Z", "2023-11-14T22:15:19.000Z"]
    assert told["all"][0] == "160"
    assert hours == "0.1 robot-hours of odometry."


def test_a_vacuum_says_that_it_is_done(
    capsys: pytest.CaptureFixture[str], old_rows: str
) -> None:
    capsys.readouterr()

    assert run(["db", "vacuum"]) == 0
    assert capsys.readouterr().out == "The room of deleted rows is given back.\n"


# --- the demo's addresses ---------------------------------------------------------


def test_a_default_port_that_is_taken_moves_and_a_chosen_one_does_not() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        settings = Settings(port=port, mqtt_url=f"mqtt://127.0.0.1:{port}")

        moved = on_free_ports(settings, {})
        with pytest.raises(SettingsError, match="a port that is free"):
            on_free_ports(settings, {"IVEG_PORT": str(port)})

    assert moved.port != port
    assert moved.mqtt_url != settings.mqtt_url


def test_the_demos_fiware_is_on_loopback_alone() -> None:
    with pytest.raises(SettingsError, match="loopback"):
        on_free_ports(Settings(mqtt_url="mqtt://10.1.2.3:1883"), {})


@pytest.mark.parametrize(
    ("host", "link"),
    [
        ("127.0.0.1", "http://127.0.0.1:8000/signin#token=abc"),
        ("::1", "http://[::1]:8000/signin#token=abc"),
    ],
)
def test_the_link_signs_a_browser_in(host: str, link: str) -> None:
    assert sign_in_link(Settings(host=host), "abc") == link


class Screen(io.StringIO):
    """What a person reads, or a log that nobody does."""

    def __init__(self, *, is_terminal: bool) -> None:
        super().__init__()
        self._is_terminal = is_terminal

    def isatty(self) -> bool:
        """Whether somebody sits before it."""
        return self._is_terminal


def test_13_16_a_terminal_shows_the_link_as_a_code_too_and_a_log_does_not() -> None:
    terminal, log = Screen(is_terminal=True), Screen(is_terminal=False)
    for out in (terminal, log):
        print_sign_in_link(Settings(), "abc", out)

    assert log.getvalue() == "iVeg: http://127.0.0.1:8000/signin#token=abc\n"
    link, *code = terminal.getvalue().splitlines()
    assert link == log.getvalue().strip()
    assert len(code) > 10


@pytest.mark.parametrize("policy", ["stop", "slow"])
def test_what_robots_do_without_feedback_is_a_setting(
    tmp_path: Path, policy: Literal["stop", "slow"]
) -> None:
    assert node_settings(Settings(), tmp_path).on_link_loss == "stop"
    settings = Settings(on_link_loss=policy)
    assert node_settings(settings, tmp_path).on_link_loss == policy
