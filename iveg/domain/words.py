"""Words of detectors: what each means, and what operators said of unknown ones.

::

    number, empty ──> the robot's class list ──> a word, or nobody knows
    word ──> person, robot, harmless ──> known
         └─> unknown: asked once (P3), until an operator says what it is
"""

import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import DetectionFrame

Meaning = Literal["person", "robot", "harmless"]


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
"""Words that with a number are no more than the number."""
_APART = re.compile(r"[\W_]+")
_MOST_ASKED = 16
"""Words of one detector that wait for an answer at most."""
_NAME = re.compile(r"[^\W\d][\w .'/-]*")
_NUMBERED_LINE = re.compile(r"(\d+)\s*:\s*(.*)")


@lru_cache(maxsize=4096)
def plain(word: str) -> str:
    """A word without case, accents, marks and numbers; empty: it is no more than these.

    ``Person_0``, ``0: person`` and ``person 2`` are ``person``.
    """
    folded = unicodedata.normalize(
        "NFKD", unicodedata.normalize("NFKC", word).casefold()
    )
    letters = "".join(c for c in folded if not unicodedata.combining(c))
    parts = [part.strip("0123456789") for part in _APART.split(letters)]
    kept = [part for part in parts if part and not part.isnumeric()]
    if len(kept) == 1 and kept[0] in _NUMBERED and any(map(str.isnumeric, letters)):
        return ""
    return " ".join(kept)


@lru_cache(maxsize=4096)
def meaning_of(word: str) -> Meaning | None:
    """Meaning that a word has for every detector; a person in it counts first."""
    parts = set(plain(word).split())
    if parts & _PERSON:
        return "person"
    if parts & _ROBOT:
        return "robot"
    return "harmless" if parts and parts <= _HARMLESS else None


def read_classes(text: str) -> tuple[str, ...]:
    """A class list: names by their number, from 0 on, one a line.

    Raises:
        UnreadableError: ``line N`` and why: no line is left out, so that no name gets
            the number of another one.
    """
    names: list[str] = []
    for number, line in enumerate(text.rstrip().splitlines()):
        names.append(_class_in(line.strip(), number))
        if names[-1].casefold() in {name.casefold() for name in names[:-1]}:
            raise UnreadableError(f"line {number + 1}", "a name that stands above, too")
    return tuple(names)


def _class_in(line: str, number: int) -> str:
    place, name = f"line {number + 1}", line
    if numbered := _NUMBERED_LINE.fullmatch(line):
        name = numbered[2]
        if int(numbered[1]) != number:
            raise UnreadableError(place, f"number {numbered[1]} where {number} comes")
    if not _NAME.fullmatch(name) or not plain(name):
        raise UnreadableError(place, "no name of a class")
    return name


def name_numbers(frame: DetectionFrame, classes: Sequence[str]) -> DetectionFrame:
    """The frame with words for numbers; a box without a word counts as unread."""
    detections = frame.detections
    if all(plain(detection.class_id) for detection in detections) and all(
        word is None or plain(word) for word in frame.unread
    ):
        return frame
    named = [(found, _named(found.class_id, classes)) for found in detections]
    return replace(
        frame,
        detections=tuple(
            found if found.class_id == word else replace(found, class_id=word)
            for found, word in named
            if word is not None
        ),
        unread=(
            *(word and _named(word, classes) for word in frame.unread),
            *(None for _, word in named if word is None),
        ),
    )


def _named(word: str, classes: Sequence[str]) -> str | None:
    if plain(word):
        return word
    number = unicodedata.normalize("NFKC", word).strip()
    is_listed = number.isdecimal() and int(number) < len(classes)
    return classes[int(number)] if is_listed else None


@dataclass(frozen=True, slots=True)
class WordAnswer:
    """An operator's word on a detector's word.

    Attributes:
        word: As ``plain`` has it.
        is_person: Whether it stands for a person.
        by: Who said so; ``since`` when (Unix s).
    """

    detector: str
    word: str
    is_person: bool
    by: str
    since: float


@dataclass(slots=True)
class HeardWords:
    """Words of one detector of one robot.

    Attributes:
        is_understood: Whether any of its words is known or answered.
        unknown: Those that wait for an answer, the first first.
    """

    is_understood: bool = False
    unknown: dict[str, None] = field(default_factory=dict)

    def hear(self, known: Iterable[bool], unknown: Iterable[str]) -> None:
        """Note the words of a frame."""
        self.is_understood = self.is_understood or any(known)
        for word in unknown:
            if len(self.unknown) < _MOST_ASKED:
                self.unknown.setdefault(word)

    @property
    def is_strange(self) -> bool:
        """Whether nothing that it says is understood: somebody may be all of it."""
        return bool(self.unknown) and not self.is_understood


class WordAnswers:
    """Answers of operators, by detector and word."""

    def __init__(self) -> None:
        self.known: dict[tuple[str, str], WordAnswer] = {}

    def add(self, answer: WordAnswer) -> None:
        """Take an answer in; it replaces an earlier one."""
        self.known[answer.detector, answer.word] = answer

    def is_person(self, detector: str, word: str) -> bool | None:
        """Whether a word was said to stand for a person; None: nobody said."""
        answer = self.known.get((detector, plain(word))) if self.known else None
        return None if answer is None else answer.is_person

    def persons(self, detector: str) -> list[str]:
        """Words of a detector that stand for a person by an operator's word."""
        return [
            answer.word
            for answer in self.known.values()
            if answer.is_person and answer.detector == detector
        ]
