"""``.ci/setup`` on machines that are made up: programs in a directory, a root below it.

The programs of a machine are scripts of one line; ``apt-get`` writes down what it was
asked for, so nothing is ever installed.
"""

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from shutil import which

import pytest

from tests.processes import ROOT

_TOOLS = (
    *("bash", "cat", "chmod", "env", "grep", "readlink"),
    *("rm", "sort", "tee", "test"),
)
_ALL = ("chromium", "git", "initdb", "make", "mosquitto", "node", "npm", "openssl")
_APT = 'echo "apt-get $*" >> "$APT_LOG"; ls "$IVEG_SETUP_ROOT/usr/sbin" >> "$APT_LOG"'


@dataclass(frozen=True)
class Machine:
    """A made-up machine."""

    root: Path

    @property
    def programs(self) -> Path:
        return self.root / "bin"

    @property
    def policy(self) -> Path:
        return self.root / "usr/sbin/policy-rc.d"

    def has(self, *names: str, says: str = "exit 0") -> None:
        for name in names:
            program = self.programs / name
            program.unlink(missing_ok=True)
            program.write_text(f"#!{which('bash')}\n{says}\n")
            program.chmod(0o755)

    def lacks(self, *names: str) -> None:
        for name in names:
            (self.programs / name).unlink()

    def is_a(self, system: str) -> None:
        (self.root / "etc/os-release").write_text(f"NAME=x\nID={system}\n")

    def asked_of_apt(self) -> list[str]:
        """Its calls, each followed by what lay in ``/usr/sbin`` at that time."""
        log = self.root / "apt.log"
        return log.read_text().splitlines() if log.exists() else []

    def set_up(self, *words: str, **more: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [str(ROOT / ".ci/setup"), *words],
            env={
                "PATH": str(self.programs),
                "HOME": str(self.root),
                "IVEG_SETUP_ROOT": str(self.root),
                "APT_LOG": str(self.root / "apt.log"),
                **more,
            },
            capture_output=True,
            text=True,
            check=False,
            timeout=30,
        )


@pytest.fixture
def debian(tmp_path: Path) -> Machine:
    """A Debian with all that iVeg needs, used by root."""
    for folder in ("bin", "usr/sbin", "etc/ssl/certs"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "etc/ssl/certs/ca-certificates.crt").touch()
    machine = Machine(tmp_path)
    machine.is_a("debian")
    machine.has(*_ALL)
    machine.has("apt-get", says=_APT)
    machine.has("id", says="echo 0")
    for tool in ("ls", *_TOOLS):
        (machine.programs / tool).symlink_to(str(which(tool)))
    (machine.programs / "python3").symlink_to(sys.executable)
    return machine


def test_a_machine_that_has_everything_is_left_alone_in_silence(
    debian: Machine,
) -> None:
    done = debian.set_up("venv", "test", "check", IVEG_SETUP="off")

    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert debian.asked_of_apt() == []


def test_on_debian_root_installs_what_is_missing_and_says_so_first(
    debian: Machine,
) -> None:
    debian.lacks("chromium", "mosquitto", "initdb", "npm")

    done = debian.set_up("venv", "test", "check")

    (said,) = done.stdout.splitlines()
    assert "iVeg needs chromium-headless-shell mosquitto npm postgresql" in said
    assert "IVEG_SETUP=off" in said
    assert done.returncode == 0
    assert debian.asked_of_apt()[-2].endswith(
        "install -y --no-install-recommends "
        "chromium-headless-shell mosquitto npm postgresql"
    )


def test_a_failed_installation_ends_non_zero_and_takes_the_policy_back(
    debian: Machine,
) -> None:
    debian.lacks("mosquitto")
    debian.has("apt-get", says="exit 100")

    done = debian.set_up("test")

    assert done.returncode == 100
    assert not debian.policy.exists()


@pytest.mark.parametrize("sudo", ["exit 1", None])
def test_where_sudo_would_ask_one_line_says_what_to_run(
    debian: Machine, sudo: str | None
) -> None:
    debian.lacks("mosquitto")
    debian.has("id", says="echo 1000")
    debian.has(*["sudo"] * (sudo is not None), says=str(sudo))

    done = debian.set_up("test")

    (said,) = done.stderr.splitlines()
    assert done.returncode == 1
    assert "apt-get install mosquitto" in said
    assert debian.asked_of_apt() == []


@pytest.mark.parametrize("system", ["ubuntu", "fedora"])
def test_elsewhere_nothing_is_installed_and_one_line_names_what_and_how(
    debian: Machine, system: str
) -> None:
    debian.is_a(system)
    debian.lacks("chromium", "mosquitto")

    done = debian.set_up("venv", "test")

    (said,) = done.stderr.splitlines()
    assert done.returncode == 1
    assert "chromium-headless-shell mosquitto" in said
    assert "playwright install chromium" in said
    assert debian.asked_of_apt() == []


def test_a_python_that_is_too_old_is_named(debian: Machine) -> None:
    debian.lacks("python3")
    debian.has("python3", says="exit 1")

    done = debian.set_up("venv")

    assert done.returncode == 1
    assert "Python 3.11 or later" in done.stderr
