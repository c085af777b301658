"""What only some commands need is installed only where they run."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from iveg.adapters.extras import EXTRAS
from iveg.adapters.history.engine import writing_engine
from iveg.app import open_provider
from iveg.cli import UNUSABLE, main
from iveg.domain.errors import MissingExtraError
from iveg.settings import Settings
from tests.processes import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
PRODUCTION = """
import sys
for name in sys.argv[1:]:
    sys.modules[name] = None
import iveg.cli.doctor, iveg.cli.replay, iveg.cli.robot, iveg.lab.commands.emulator
import iveg.cli.serve
"""


@pytest.fixture
def without(monkeypatch: pytest.MonkeyPatch, extra: str) -> str:
    """An installation that lacks one extra, and no variable of this machine."""
    for name in Settings().to_environment():
        monkeypatch.delenv(name, raising=False)
    library = EXTRAS[extra]
    parts = [name for name in sys.modules if name.split(".")[0] == library]
    for name in {library, *parts}:
        monkeypatch.setitem(sys.modules, name, None)
    return extra


def test_the_dss_robots_and_the_emulator_start_without_any_extra() -> None:
    run = subprocess.run(
        [sys.executable, "-c", PRODUCTION, *EXTRAS.values()],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )

    assert (run.returncode, run.stderr) == (0, "")


@pytest.mark.parametrize(
    ("extra", "command"),
    [
        ("ros2", ["robot", "--id", "AGI"]),
        ("ros2", ["emulator", "--dds"]),
    ],
)
def test_a_command_without_its_extra_says_in_one_sentence_what_to_install(
    without: str,
    command: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("IVEG_DATA_DIRECTORY", str(tmp_path))

    code = main(command)

    (sentence,) = capsys.readouterr().err.splitlines()
    assert code == UNUSABLE
    assert sentence.startswith(f"iveg: iveg {command[0]}")
    assert sentence.endswith(
        f"needs {EXTRAS[without]}, which is not installed: "
        f"pip install 'iveg[{without}]'."
    )


@pytest.mark.parametrize("extra", ["sso"])
def test_an_identity_provider_without_its_extra_names_the_setting(
    without: str, tmp_path: Path
) -> None:
    settings = Settings(
        sso_issuer="https://a.test", sso_client_id="b", sso_roles=(("c", "viewer"),)
    )

    with pytest.raises(MissingExtraError, match=r"IVEG_SSO_ISSUER.*iveg\[sso\]"):
        open_provider(settings)


@pytest.mark.parametrize("extra", ["postgresql"])
def test_a_database_without_its_extra_names_the_setting_and_what_to_install(
    without: str,
) -> None:
    with pytest.raises(MissingExtraError, match=rf"DATABASE_URL.*iveg\[{without}\]"):
        writing_engine("postgresql://nobody@127.0.0.1/iveg")


def test_every_extra_brings_the_library_that_its_users_ask_for() -> None:
    brought = PROJECT["optional-dependencies"]

    assert [
        extra
        for extra, library in EXTRAS.items()
        if not any(line.startswith(library) for line in brought[extra])
    ] == []


def test_what_a_site_installs_holds_no_library_of_an_extra() -> None:
    always = [line.split(">")[0] for line in PROJECT["dependencies"]]

    assert set(always) & set(EXTRAS.values()) == set()
