"""Scenarios of an experiment with their durations, and its directory."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, get_args

import orjson

from iveg.domain.errors import DataFileError

Size = Literal["minimal", "quick", "full"]
RuleName = Literal["iveg", "paper"]
"""The rule as it stands, or Algorithm 2 alone: single boxes, no laser, no foresight."""
FAMILIES: Final = ("viewpoints", "peers", "together", "occluded", "nlos")
"""The paper's four scenarios and its test without a line of sight."""
ROBOTS: Final = ("AGI", "AGII")
"""The paper's fleet, independent of the site's own."""
GREENHOUSE: Final = "mvsim-20x20"
SEED: Final = 2026
PEOPLED: Final = "demo"
"""Scenario of the runs for protection alone: four people at work."""


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """One run of one scenario.

    Attributes:
        seconds: Duration in real time, through all programs (s); 0: not at all.
        counted_s: Duration on the virtual clock, which gives the counts (s).
        seed: Random seed of its people and its detector's noise.
        profile: Profile of the emulated detector; ``rule``: rule that slows robots.
    """

    family: str
    number: int
    seconds: float
    seed: int
    counted_s: float = 60.0
    profile: str = "field"
    rule: RuleName = "iveg"

    @property
    def is_timed(self) -> bool:
        """Whether it has a half in real time."""
        return self.seconds > 0.0

    @property
    def name(self) -> str:
        """Name of its raw data."""
        compared = "" if self.is_timed else f"{self.profile}-{self.rule}-"
        return f"{self.family}-{compared}{self.number}"


@dataclass(frozen=True, slots=True)
class ExperimentPlan:
    """All runs of an experiment.

    Attributes:
        seconds: Duration of each run in real time; ``runs`` of each family.
        counted_s: Duration of each run on the virtual clock (s).
        profile: Detector profile of the emulator: ``simulation`` or ``field``.
        protected_s: Duration of each run for protection alone (s), on the virtual
            clock, one for each rule; ``profiles`` of them beside ``profile``.
    """

    size: Size
    runs: int
    seconds: float
    families: tuple[str, ...] = FAMILIES
    seed: int = SEED
    profile: str = "field"
    counted_s: float = 60.0
    protected_s: float = 120.0
    profiles: tuple[str, ...] = ()

    def steps(self) -> Iterator[PlannedRun]:
        """All runs in order; every family's first run precedes any second one."""
        for number in range(1, self.runs + 1):
            yield from self._compared(number)
            for place, family in enumerate(self.families):
                seed = self.seed + 100 * place + number
                times = self.seconds, seed, self.counted_s
                yield PlannedRun(family, number, *times, self.profile)

    def _compared(self, number: int) -> Iterator[PlannedRun]:
        """Runs of one seed that differ in profile and rule alone."""
        times = 0.0, self.seed + 100 * len(FAMILIES) + number, self.protected_s
        for profile in sorted({self.profile, *self.profiles}):
            for rule in get_args(RuleName):
                yield PlannedRun(PEOPLED, number, *times, profile, rule)


PLANS: Final[dict[Size, ExperimentPlan]] = {
    "minimal": ExperimentPlan(
        "minimal", 1, 5.0, ("together",), counted_s=5.0, protected_s=5.0
    ),
    "quick": ExperimentPlan("quick", 1, 17.0, protected_s=90.0),
    "full": ExperimentPlan("full", 5, 28.0, profiles=("field", "simulation")),
}
"""Two robots send about 180 messages a second: quick has 15,000, full 126,000.  Five
runs of each are the paper's own number in simulation."""


def write_json(file: Path, value: object) -> None:
    """Write one of an experiment's files."""
    file.write_bytes(orjson.dumps(value))


def directory_of(place: Path, size: Size) -> Path:
    """The next free directory for an experiment of this size."""
    known = len(list(place.glob(f"{size}-*")))
    return place / f"{size}-{known + 1:03d}"


def claim(directory: Path) -> None:
    """Make a directory for an experiment.

    Raises:
        DataFileError: it holds something already.
    """
    directory.mkdir(parents=True, exist_ok=True)
    if any(directory.iterdir()):
        raise DataFileError(str(directory), "", "is not empty; name another directory")
