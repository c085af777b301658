"""The alert rule (Algorithm 2) and the zone that it draws.

A detection with confidence at or above the threshold and of class person or robot is
an alert; below the threshold it is faint; any other confident class is a time stamp.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

from iveg.domain.comparison import Comparison
from iveg.domain.parameters import PARAMETERS, Class, Parameters
from iveg.domain.words import meaning_of, plain

Kind = Literal["alert", "faint", "other"]

RECOVERED: Final = "recovered"
"""Author of a version that was made from what could be read of a damaged file."""

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


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionRule(Parameters):
    """One version of the rule; part of every decision that it makes.

    Attributes:
        aliases: Class as a detector names it, in lower case → canonical class.
        possible_people: Whether looks add up.  False only in versions that were stored
            before every one had it; no rule in force lacks it.
        comparison: What came of the trial that it was before; None: it was none.
        author: Who made this version; ``since`` when (Unix s), None for the first.
    """

    id: str = "fleet-alert"
    version: int = 1
    aliases: Mapping[str, Class] = field(default_factory=lambda: ALIASES)
    possible_people: bool = True
    comparison: Comparison | None = None
    author: str = "settings"
    since: float | None = None

    @classmethod
    def of(cls, parameters: Parameters) -> "DetectionRule":
        """The first version with these parameters."""
        values: dict[str, Any] = {
            row.name: getattr(parameters, row.name) for row in PARAMETERS
        }
        return cls(**values)

    def class_of(self, class_id: str | None) -> Class | None:
        """The canonical class of a detector's word; None for any other.

        No table takes away what a word means to everybody: it may only add.
        """
        if class_id is None:
            return None
        aliases = self.aliases
        named = aliases.get(class_id.strip().lower()) or aliases.get(plain(class_id))
        meaning = named or meaning_of(class_id)
        return None if meaning == "harmless" else meaning

    def also_naming(self, people: Iterable[str]) -> "DetectionRule":
        """Copy of the rule for which these plain words are people, too."""
        named: dict[str, Class] = dict.fromkeys(people, "person")
        return replace(self, aliases={**self.aliases, **named}) if named else self

    def judge(self, class_id: str, confidence: float) -> RuleVerdict:
        """Judge one detection (Algorithm 2, lines 4-10)."""
        class_ = self.class_of(class_id)
        if confidence < self.threshold.of(class_):
            return RuleVerdict("faint", class_)
        return RuleVerdict("other" if class_ is None else "alert", class_)

    def foresees(self, in_s: float) -> bool:
        """Whether an encounter so soon (s) is within the horizon."""
        # Moments are sums of steps.
        return in_s <= self.foresight_s + 1e-6


def strictest(rules: Iterable[DetectionRule], since: float) -> DetectionRule:
    """The next version, which slows wherever one of these would.

    Of each parameter the value that protects most, of any class; every alias, and a
    word that stands for a person in one of them does so here.

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
    strict: dict[str, Any] = {
        row.name: row.strictest(getattr(rule, row.name) for rule in every)
        for row in PARAMETERS
    }
    return DetectionRule(
        **strict,
        id=every[-1].id,
        version=max(rule.version for rule in every) + 1,
        aliases=aliases,
        author=RECOVERED,
        since=since,
    )
