"""The alert rule (Algorithm 2), and the words of detectors that it understands.

A detection with confidence at or above the threshold and of class person or robot is
an alert; below the threshold it is faint; any other confident class is only a time
stamp.  A word means the same in any writing and in every detector; no table of a rule
takes away a word's general meaning.
"""

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Final, Literal, NamedTuple

from iveg.domain.comparison import Comparison
from iveg.domain.parameters import PARAMETERS, Class, Parameters

Kind = Literal["alert", "faint", "other"]
Meaning = Literal["person", "robot", "harmless"]

# --- words ------------------------------------------------------------------------


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_PERSON = _words("""
    person persons people human humans humanoid man men woman women boy boys girl girls
    child children kid kids baby adult adults somebody someone farmer farmers farmworker
    worker workers operator operators pedestrian pedestrians grower growers picker
    pickers gardener gardeners employee employees staff visitor visitors rider cyclist
    persona personas gente humano humana humanos humanas hombre hombres mujer mujeres
    nino nina ninos ninas chico chica bebe adulto adulta adultos adultas alguien
    agricultor agricultora agricultores agricultoras trabajador trabajadora trabajadores
    trabajadoras obrero obrera obreros obreras operario operaria operarios operarias
    operador operadora operadores operadoras peon peones peaton peatones jornalero
    jornalera jornaleros jornaleras recolector recolectora recolectores recolectoras
    empleado empleada empleados empleadas visitante visitantes ciclista
""")
_ROBOT = _words("robot robots agi agii husky huskies agv agvs amr amrs ugv")
_HARMLESS = _words("""
    tomato tomatoes tomate tomates pepper peppers pimiento pimientos cucumber cucumbers
    pepino pepinos aubergine aubergines eggplant berenjena berenjenas fruit fruits fruta
    frutas plant plants planta plantas leaf leaves hoja hojas flower flowers flor flores
    crate crates caja cajas background fondo
""")
_NUMBERED = _words("class classes cls clase id label category type object obj")
"""Words that mean nothing beside a number: ``class 3``."""
_APART = re.compile(r"[\W_]+")


@lru_cache(maxsize=4096)
def plain(word: str) -> str:
    """A word without case, accents, marks and numbers; empty: nothing else is in it.

    ``Person_0``, ``0: person`` and ``person 2`` are ``person``.
    """
    folded = unicodedata.normalize(
        "NFKD", unicodedata.normalize("NFKC", word).casefold()
    )
    letters = "".join(c for c in folded if not unicodedata.combining(c))
    parts = [part.strip("0123456789") for part in _APART.split(letters)]
    words = [part for part in parts if part and not part.isnumeric()]
    if len(words) == 1 and words[0] in _NUMBERED and any(map(str.isnumeric, letters)):
        return ""
    return " ".join(words)


@lru_cache(maxsize=4096)
def meaning_of(word: str) -> Meaning | None:
    """Meaning of a word for every detector; a person in it counts first."""
    parts = set(plain(word).split())
    if parts & _PERSON:
        return "person"
    if parts & _ROBOT:
        return "robot"
    return "harmless" if parts and parts <= _HARMLESS else None


# --- rule -------------------------------------------------------------------------

RECOVERED: Final = "recovered"
"""Author of a version from the readable part of a damaged file."""

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


class RuleVerdict(NamedTuple):
    """Result of the rule for one detection.

    Attributes:
        class_: ``person``, ``robot``, or None for a class that the rule does not name.
        is_known: Whether its word has a meaning, in this rule or in general.
    """

    kind: Kind
    class_: Class | None
    is_known: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionRule(Parameters):
    """One version of the rule; part of every decision that it makes.

    Attributes:
        aliases: Class as a detector names it, in lower case → canonical class.
        possible_people: Whether looks add up.  False only in versions that an earlier
            iVeg stored; every rule in force has it.
        comparison: Result of the trial from which it came; None: there was none.
        author: The author of this version; ``since`` when (Unix s), None for the first.
    """

    id: str = "fleet-alert"
    version: int = 1
    aliases: Mapping[str, Class] = field(default_factory=lambda: ALIASES)
    possible_people: bool = True
    comparison: Comparison | None = None
    author: str = "settings"
    since: float | None = None

    @classmethod
    def from_parameters(cls, parameters: Parameters) -> "DetectionRule":
        """The first version with these parameters."""
        values: dict[str, Any] = {
            row.name: getattr(parameters, row.name) for row in PARAMETERS
        }
        return cls(**values)

    def class_of(self, class_id: str) -> Class | None:
        """The canonical class of a detector's word; None for any other.

        No table takes away a word's general meaning: it may only add words.
        """
        meaning = meaning_of(class_id)
        if meaning == "person":
            return meaning
        # A table may hold a word as the detector writes it, or in its plain form.
        aliases = self.aliases
        named = aliases.get(class_id.strip().lower()) or aliases.get(plain(class_id))
        return named or (None if meaning == "harmless" else meaning)

    def also_naming(self, people: Iterable[str]) -> "DetectionRule":
        """Copy of the rule for which these plain words are people, too."""
        named: dict[str, Class] = dict.fromkeys(people, "person")
        return replace(self, aliases={**self.aliases, **named}) if named else self

    def judge(self, class_id: str, confidence: float) -> RuleVerdict:
        """Judge one detection (Algorithm 2, lines 4-10)."""
        class_ = self.class_of(class_id)
        is_known = class_ is not None or meaning_of(class_id) is not None
        if confidence < self.threshold.for_class(class_):
            return RuleVerdict("faint", class_, is_known)
        return RuleVerdict("other" if class_ is None else "alert", class_, is_known)

    def foresees(self, in_s: float) -> bool:
        """Whether an encounter so soon (s) is within the horizon."""
        # Moments are sums of steps, so an exact horizon needs a tolerance.
        return in_s <= self.foresight_s + 1e-6


def strictest(rules: Iterable[DetectionRule], since: float) -> DetectionRule:
    """The next version, which slows wherever any of these would.

    Each parameter has its most protective value of any class.  Every alias stays, and a
    word that means a person in any of these rules means a person.

    Args:
        rules: At least one, oldest first.
        since: When it is made (Unix s).
    """
    every = list(rules)
    aliases: dict[str, Class] = {}
    for rule in every:
        aliases.update(rule.aliases)
    # The meaning person in any rule goes before other meanings of the word.
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
