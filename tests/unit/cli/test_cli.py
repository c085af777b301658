"""Words and settings become parts, or one clear sentence and an exit code."""

import socket
from collections.abc import Sequence
from pathlib import Path

import pytest

from iveg.cli import UNUSABLE, main
from iveg.cli.running import sign_in_link
from iveg.domain.errors import SettingsError
from iveg.lab.commands.demo import on_free_ports
from iveg.settings import Settings


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


def test_settings_that_are_gone_are_named_in_one_warning_and_end_nothing(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("IVEG_TRUTH", "truth.ndjson")

    code = main(["settings"])

    assert code == 0
    assert [one.getMessage() for one in caplog.records] == [
        "IVEG_TRUTH: no longer a setting (docs/upgrading.md)"
    ]


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
        ["emulator", "--robots", "0"],
        ["replay", "log.jsonl", "--robot", "AGI", "--speed", "0"],
        ["replay", "log.jsonl", "--robot", "AGI", "--frame", "our map"],
        ["db", "downgrade"],
    ],
)
def test_words_that_mean_nothing_are_refused(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == UNUSABLE
    assert "usage:" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["AGX"], "AGX"),
        (["AGI", "--force"], "AGI:recording in IVEG_ROBOTS"),
        (["D1"], "not on loopback"),
    ],
    ids=["outside the fleet", "live", "on a broker elsewhere"],
)
def test_what_a_recording_is_not_played_as_or_on_is_refused(
    words: list[str],
    told: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("IVEG_MQTT_URL", "mqtt://greenhouse.test")
    monkeypatch.setenv("IVEG_ROBOTS", "AGI,D1:recording")

    assert run(["replay", "log.jsonl", "--robot", *words]) == UNUSABLE
    assert told in capsys.readouterr().err


def test_provisioning_a_fiware_that_is_away_says_so(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("IVEG_IOTA_URL", "http://127.0.0.1:9")
    monkeypatch.setenv("IVEG_ORION_URL", "http://127.0.0.1:9")

    assert run(["provision"]) == 1
    assert "cannot be reached" in capsys.readouterr().err


def test_a_database_that_is_not_there_is_one_sentence(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert run(["export", "decisions"]) == 1
    said = f"there is none at {tmp_path / 'iveg' / 'iveg.sqlite'}; `iveg db upgrade`"
    assert said in capsys.readouterr().err


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
