"""Scenarios of an experiment, with their repetitions and durations."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

Size = Literal["minimal", "quick", "full"]
FAMILIES: Final = ("viewpoints", "peers", "together", "occluded", "nlos")
"""The paper's four scenarios and its test without a line of sight."""
ROBOTS: Final = ("AGI", "AGII")
"""The paper's fleet, independent of the site's own."""
WATCHED: Final = "AGII"
"""Robot whose costmap is examined: the one without sight in the paper's test."""
GREENHOUSE: Final = "mvsim-20x20"
SEED: Final = 2026


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """One run of one scenario.

    Attributes:
        seconds: Duration in real time, through all programs (s).
        counted_s: Duration on the virtual clock, which gives the counts (s).
        seed: Random seed of its people and its detector's noise.
    """

    family: str
    number: int
    seconds: float
    seed: int
    counted_s: float = 60.0

    @property
    def name(self) -> str:
        """Name of its file."""
        return f"{self.family}-{self.number}"


@dataclass(frozen=True, slots=True)
class Plan:
    """All runs of an experiment.

    Attributes:
        seconds: Duration of each run in real time; ``runs`` of each family.
        counted_s: Duration of each run on the virtual clock (s).
        profile: Detector profile of the emulator: ``simulation`` or ``field``.
    """

    size: Size
    runs: int
    seconds: float
    families: tuple[str, ...] = FAMILIES
    seed: int = SEED
    profile: str = "field"
    counted_s: float = 60.0

    def steps(self) -> Iterator[PlannedRun]:
        """All runs in order; every family's first run precedes any second one."""
        for number in range(1, self.runs + 1):
            for place, family in enumerate(self.families):
                seed = self.seed + 100 * place + number
                yield PlannedRun(family, number, self.seconds, seed, self.counted_s)


PLANS: Final[dict[Size, Plan]] = {
    "minimal": Plan("minimal", 1, 5.0, ("together",), counted_s=5.0),
    "quick": Plan("quick", 1, 18.0),
    "full": Plan("full", 5, 28.0),
}
"""Two robots send about 180 messages a second: quick has 16,000, full 126,000.  Five
runs of each are the paper's own number in simulation."""
