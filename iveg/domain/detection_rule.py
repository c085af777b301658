"""The alert rule (Algorithm 2) and the ring that it draws.

A detection with confidence at or above the threshold and of class person or robot is
an alert; below the threshold it is faint; any other confident class is a time stamp.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

from iveg.domain.comparison import Comparison
from iveg.domain.limits import LIMITS, ring_radius

Class = Literal["person", "robot"]
Kind = Literal["alert", "faint", "other"]

FORESIGHT_LEAST_S: Final = 0.5
"""The shortest horizon of foresight (s)."""
FORESIGHT_MOST_S: Final = 3.0
"""The farthest (s): so far it was measured how much comes true."""
RECOVERED: Final = "recovered"
"""Author of a version that was made from what could be read of a damaged file."""
UPGRADED: Final = "upgrade"
"""Author of a version that was made since its last one lacks what all have now."""

ALIASES: Mapping[str, Class] = {
    "person": "person",
    "farmer": "person",
    "human": "person",
    "operator": "person",
    "worker": "person",
    "pedestrian": "person",
    "robot": "robot",
    "agi": "robot",
    "agii": "robot",
    "husky": "robot",
}


@dataclass(frozen=True, slots=True)
class RuleVerdict:
    """Result of the rule for one detection.

    Attributes:
        class_: ``person``, ``robot``, or None for a class that the rule does not name.
    """

    kind: Kind
    class_: Class | None


@dataclass(frozen=True, slots=True)
class DetectionRule:
    """One version of the rule; part of every decision that it makes.

    Attributes:
        threshold: Least confidence, inclusive; ``class_thresholds`` by canonical class.
        radius_m: Ring of a fresh sighting, inclusive (m).
        aliases: Class as a detector names it, in lower case → canonical class.
        possible_people: Whether looks add up.  False only in versions that were stored
            before every one had it; no rule in force lacks it.
        foresight: Whether a robot slows before it reaches a ring, to be slow there.
        foresight_s: How far ahead that looks (s).
        comparison: What came of the trial that it was before; None: it was none.
        author: Who made this version; ``since`` when (Unix s), None for the first.
    """

    id: str = "fleet-alert"
    version: int = 1
    threshold: float = LIMITS.detection_threshold
    class_thresholds: Mapping[Class, float] = field(default_factory=dict)
    radius_m: float = LIMITS.ring_default_m
    aliases: Mapping[str, Class] = field(default_factory=lambda: ALIASES)
    possible_people: bool = True
    foresight: bool = True
    foresight_s: float = FORESIGHT_MOST_S
    comparison: Comparison | None = None
    author: str = "settings"
    since: float | None = None

    def threshold_of(self, class_: Class | None) -> float:
        """Least confidence of a canonical class; None stands for any other class."""
        if class_ is None:
            return self.threshold
        return self.class_thresholds.get(class_, self.threshold)

    def class_of(self, class_id: str | None) -> Class | None:
        """The canonical class of a detector's word; None for any other."""
        return None if class_id is None else self.aliases.get(class_id.strip().lower())

    def judge(self, class_id: str, confidence: float) -> RuleVerdict:
        """Judge one detection (Algorithm 2, lines 4-10)."""
        class_ = self.class_of(class_id)
        if confidence < self.threshold_of(class_):
            return RuleVerdict("faint", class_)
        return RuleVerdict("other" if class_ is None else "alert", class_)

    def foresees(self, in_s: float) -> bool:
        """Whether an encounter so soon (s) is within the horizon."""
        # Moments are sums of steps.
        return in_s <= self.foresight_s + 1e-6

    def radius_at(self, age_s: float) -> float:
        """The ring of a sighting that is ``age_s`` old (m)."""
        if age_s <= LIMITS.growth_grace_s:
            # Of most, and asked thousands of times a second.
            return self.radius_m
        return ring_radius(self.radius_m, age_s)


def strictest(rules: Iterable[DetectionRule], since: float) -> DetectionRule:
    """The next version, which slows wherever one of these would.

    The least threshold of any class, the widest ring, every alias, and a word that
    stands for a person in one of them does so here.

    Args:
        rules: At least one, oldest first.
        since: When it is made (Unix s).
    """
    every = list(rules)
    aliases: dict[str, Class] = {}
    for rule in every:
        aliases.update(rule.aliases)
    for rule in every:
        aliases.update({w: "person" for w, c in rule.aliases.items() if c == "person"})
    return DetectionRule(
        id=every[-1].id,
        version=max(rule.version for rule in every) + 1,
        threshold=min(
            min((rule.threshold, *rule.class_thresholds.values())) for rule in every
        ),
        radius_m=max(rule.radius_m for rule in every),
        aliases=aliases,
        foresight=any(rule.foresight for rule in every),
        foresight_s=max(rule.foresight_s for rule in every),
        author=RECOVERED,
        since=since,
    )
