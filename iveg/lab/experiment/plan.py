"""Scenarios of an experiment with their durations, and the files of its directory."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal, get_args

import orjson

from iveg import __version__
from iveg.domain.errors import DataFileError

Size = Literal["minimal", "quick", "full"]
RuleName = Literal["iveg", "paper"]
"""The rule as it stands, or Algorithm 2 alone: single boxes, no laser, no foresight."""
FAMILIES: Final = ("viewpoints", "peers", "together", "occluded", "nlos")
"""The paper's four scenarios and its test without a line of sight."""
ROBOTS: Final = ("AGI", "AGII")
"""The paper's fleet, independent of the site's own."""
WATCHED: Final = "AGII"
"""Robot whose costmap is examined: the one without sight in the paper's test."""
GREENHOUSE: Final = "mvsim-20x20"
SEED: Final = 2026
FIELD: Final = "nlos-field"
"""The test without a line of sight on the plan of AgroConnect, with failures."""
PEOPLED: Final = "demo"
"""Scenario of the runs that only protection is scored on: four people at work."""
_STARTS_S: Final = 8.0
"""Time to start and end the programs of one run (s)."""
_COUNTED_SHARE: Final = 0.1
"""Approximate real time of a virtual second (s)."""


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """One run of one scenario.

    Attributes:
        seconds: Duration in real time, through all programs (s); 0: not at all.
        counted_s: Duration on the virtual clock, which gives the counts (s).
        seed: Random seed of its people and its detector's noise.
        profile: Of the emulated detector; ``rule`` that robots are slowed by.
        fails: Navigation and links fail as in the field (``failures``).
    """

    family: str
    number: int
    seconds: float
    seed: int
    counted_s: float = 60.0
    profile: str = "field"
    rule: RuleName = "iveg"
    fails: bool = False

    @property
    def is_timed(self) -> bool:
        """Whether it has a half in real time."""
        return self.seconds > 0.0

    @property
    def name(self) -> str:
        """Name of its file."""
        compared = "" if self.is_timed else f"{self.profile}-{self.rule}-"
        return f"{self.family}-{compared}{self.number}"


def expected_s(step: PlannedRun) -> float:
    """Estimated duration of a run (s)."""
    timed_s = step.seconds + _STARTS_S if step.is_timed else 0.0
    return timed_s + _COUNTED_SHARE * step.counted_s


@dataclass(frozen=True, slots=True)
class ExperimentPlan:
    """All runs of an experiment.

    Attributes:
        seconds: Duration of each run in real time; ``runs`` of each family.
        counted_s: Duration of each run on the virtual clock (s).
        profile: Detector profile of the emulator: ``simulation`` or ``field``.
        protected_s: Duration of each run for protection alone (s), on the virtual
            clock, one for each rule; ``profiles`` of them beside ``profile``.
        fields: Field tests for each of the others' ``runs``, likewise.
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
    fields: int = 1

    def steps(self) -> Iterator[PlannedRun]:
        """All runs in order; every family's first run precedes any second one."""
        for number in range(1, self.runs + 1):
            yield from self._compared(number)
            yield from self._fields(number)
            for place, family in enumerate(self.families):
                seed = self.seed + 100 * place + number
                times = self.seconds, seed, self.counted_s
                yield PlannedRun(family, number, *times, self.profile)

    def _fields(self, of: int) -> Iterator[PlannedRun]:
        """Field tests, which can fail."""
        for number in range((of - 1) * self.fields + 1, of * self.fields + 1):
            times = 0.0, self.seed + 100 * (len(FAMILIES) + 1) + number, self.counted_s
            yield PlannedRun(FIELD, number, *times, self.profile, fails=True)

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
    "full": ExperimentPlan("full", 5, 28.0, profiles=("field", "simulation"), fields=5),
}
"""Two robots send about 180 messages a second: quick has 15,000, full 126,000.  Five
runs of each are the paper's own number in simulation."""


FORMAT: Final = 4
"""Of results and runs; those of another are not mixed with these."""
PROGRESS: Final = "progress.json"
RAW: Final = "raw"
PLAN: Final = "plan.json"


def read_json(file: Path) -> Any:
    """Read one of our JSON files.

    Raises:
        DataFileError: the file is missing or is not JSON.
    """
    try:
        return orjson.loads(file.read_bytes())
    except (OSError, orjson.JSONDecodeError) as error:
        raise DataFileError(str(file), "", str(error)) from error


def write_json(file: Path, value: object) -> None:
    """Write atomically: after a crash the file is the old one or the new one."""
    fresh = file.with_suffix(".part")
    fresh.write_bytes(orjson.dumps(value))
    fresh.replace(file)


def directory_of(place: Path, plan: ExperimentPlan) -> Path:
    """Directory of an experiment: the newest one of this plan if incomplete, or a new.

    Results of another version or another plan are not mixed with this one.
    """
    known = sorted(place.glob(f"{plan.size}-*")) if place.is_dir() else []
    if (
        known
        and not (known[-1] / "result.json").exists()
        and belongs_to(known[-1], plan)
    ):
        return known[-1]
    return place / f"{plan.size}-{len(known) + 1:03d}"


def belongs_to(directory: Path, plan: ExperimentPlan) -> bool:
    """Whether a directory is empty, or contains runs of this very plan and version."""
    try:
        return bool(read_json(directory / PLAN) == _written(plan))
    except DataFileError:
        return not list(directory.glob("*-*.json"))


def claim(directory: Path, plan: ExperimentPlan) -> None:
    """Assign a directory to this plan.

    Raises:
        DataFileError: it contains runs of another plan, or of another version.
    """
    directory.mkdir(parents=True, exist_ok=True)
    if not belongs_to(directory, plan):
        reason = "holds runs of another plan or version; name another directory"
        raise DataFileError(str(directory), "", reason)
    write_json(directory / PLAN, _written(plan))


def _written(plan: ExperimentPlan) -> object:
    return orjson.loads(
        orjson.dumps({"version": __version__, "format": FORMAT, "plan": asdict(plan)})
    )
