"""Which scenarios are run, how often and for how long."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

Size = Literal["minimal", "quick", "full"]
FAMILIES: Final = ("viewpoints", "peers", "together", "occluded", "nlos")
"""The paper's four scenarios and its test without a line of sight."""
SEED: Final = 2026


@dataclass(frozen=True, slots=True)
class Step:
    """One run of one scenario; ``seed`` of its people and its detector's noise."""

    family: str
    number: int
    seconds: float
    seed: int

    @property
    def name(self) -> str:
        """Of its file."""
        return f"{self.family}-{self.number}"


@dataclass(frozen=True, slots=True)
class Plan:
    """All runs of an experiment.

    Attributes:
        seconds: Each run lasts; ``runs`` of each family.
        profile: Of the emulated detector: ``simulation`` or ``field``.
    """

    size: Size
    runs: int
    seconds: float
    families: tuple[str, ...] = FAMILIES
    seed: int = SEED
    profile: str = "field"

    def steps(self) -> Iterator[Step]:
        """In their order; every family's first runs come before any second."""
        for number in range(1, self.runs + 1):
            for place, family in enumerate(self.families):
                seed = self.seed + 100 * place + number
                yield Step(family, number, self.seconds, seed)


PLANS: Final[dict[Size, Plan]] = {
    "minimal": Plan("minimal", 1, 6.0, ("together",)),
    "quick": Plan("quick", 1, 22.0),
    "full": Plan("full", 6, 60.0),
}
"""Two robots send about 180 messages a second: quick has 19,000, full 320,000."""
