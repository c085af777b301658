"""Words of one robot's detector, and evidence that its pictures are read whole.

::

    number, empty ──> the robot's class list ──> a word, or nobody knows
    word ──> person, robot, harmless ──> known
         └─> unknown: raised once (P3), until an operator says what it is

Silence, a refused frame and a healthy empty aisle must never look alike, so only one
thing proves that a detector works::

    a frame read whole, at most a second old, and every other frame of that second, too

Until then it is *missing* (docs/safety.md, "Clear"), unless an operator took it out of
service.
"""

import math
import re
import unicodedata
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from iveg.domain.detection_rule import DetectionRule, RuleVerdict, plain
from iveg.domain.errors import UnreadableError
from iveg.domain.limits import LIMITS
from iveg.domain.observations import DetectionFrame, Instant

_MOST_UNKNOWN = 16
"""Most unknown words of one detector that wait for an answer."""
_NAME = re.compile(r"[^\W\d][\w .'/-]*")
_NUMBERED_LINE = re.compile(r"(\d+)\s*:\s*(.*)")
_MOST_NAMES = 4
FRAMES_HZ = 45.0
"""Most frames of a robot, as a mean over a second; the contract's rate is 30 Hz."""

Flaw = Literal["unreadable", "overload", "unplaced", "strange", "blind"]
"""Reason why a frame was not read whole.  ``unreadable``: it, or a box of a person or
robot, was refused; ``overload``: too many frames came; ``unplaced``: the robot has
never sent a pose; ``strange``: no word of its detector is understood; ``blind``: it
shows nobody where another camera surely sees somebody."""


# --- words ------------------------------------------------------------------------


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
    named = [(box, _named(box.class_id, classes)) for box in detections]
    return replace(
        frame,
        detections=tuple(
            box if box.class_id == word else replace(box, class_id=word)
            for box, word in named
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
    # Detectors may write digits of any script and width.
    number = unicodedata.normalize("NFKC", word).strip()
    is_listed = number.isdecimal() and int(number) < len(classes)
    return classes[int(number)] if is_listed else None


@dataclass(frozen=True, slots=True)
class WordAnswer:
    """An operator's answer to an unknown word of a detector.

    Attributes:
        word: The word in its ``plain`` form.
        is_person: Whether it stands for a person.
        by: The operator; ``since`` when (Unix s).
    """

    detector: str
    word: str
    is_person: bool
    by: str
    since: float


class WordAnswers:
    """Answers of operators, by detector and word.

    Args:
        robots: Names of robots, which are known words of every detector.
    """

    def __init__(self, robots: Container[str] = ()) -> None:
        self.robots = robots
        self.known: dict[tuple[str, str], WordAnswer] = {}

    def add(self, answer: WordAnswer) -> None:
        """Take an answer in; it replaces an earlier one."""
        self.known[answer.detector, answer.word] = answer

    def meanings(self, detector: str) -> Mapping[str, bool]:
        """Plain words of a detector, each with whether it stands for a person."""
        return {
            answer.word: answer.is_person
            for answer in self.known.values()
            if answer.detector == detector
        }


# --- frames -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class JudgedFrame:
    """A detection frame whose words were judged, each once.

    Attributes:
        frame: The frame, with words in place of numbers.
        rule: The rule that judged it, with operators' words for people.
        verdicts: Verdict on each detection, in the order of the frame.
        hides_somebody: Whether an unread box may be of a person or robot.
        is_understood: Whether at least one of its words is known.
        unknown: Unknown words of confident boxes.
    """

    frame: DetectionFrame
    rule: DetectionRule
    verdicts: Sequence[RuleVerdict]
    hides_somebody: bool
    is_understood: bool
    unknown: Sequence[str]


def judge_frame(
    frame: DetectionFrame,
    rule: DetectionRule,
    listed: Sequence[str],
    answers: WordAnswers,
) -> JudgedFrame:
    """Judge every word of a frame (Algorithm 2, lines 4-10).

    Args:
        frame: The frame.
        rule: The rule in force, or one on trial.
        listed: Class list of the robot.
        answers: Answers of operators to unknown words.
    """
    answered = answers.meanings(frame.detector_name)
    frame = name_numbers(frame, listed)
    rule = rule.also_naming(word for word, person in answered.items() if person)
    words = [(box.class_id, box.probability) for box in frame.detections]
    # A box that could not be read may have any confidence, so it counts as sure.
    words += [(word, 1.0) for word in frame.unread if word is not None]
    verdicts = [rule.judge(word, probability) for word, probability in words]
    read, unread = verdicts[: len(frame.detections)], verdicts[len(frame.detections) :]
    lists_people = any(rule.class_of(word) == "person" for word in listed)
    unknown = [
        (word, probability)
        for (word, probability), verdict in zip(words, verdicts, strict=True)
        if not verdict.is_known
        and word not in answers.robots
        and plain(word) not in answered
    ]
    return JudgedFrame(
        frame=frame,
        rule=rule,
        verdicts=read,
        hides_somebody=None in frame.unread
        or any(verdict.class_ for verdict in unread),
        is_understood=lists_people or len(unknown) < len(words),
        unknown=[
            plain(word)
            for word, probability in unknown
            if probability >= rule.threshold.every
            and not (lists_people and word in listed)
        ],
    )


@dataclass(slots=True)
class DetectorWords:
    """Words of one detector of one robot.

    Attributes:
        is_understood: Whether any of its words is known or answered.
        unknown: Words that wait for an answer, oldest first.
    """

    is_understood: bool = False
    unknown: dict[str, None] = field(default_factory=dict)

    @property
    def is_strange(self) -> bool:
        """Whether none of its words is understood: each of them may mean a person."""
        return bool(self.unknown) and not self.is_understood


# --- evidence ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class OutOfService:
    """An operator's statement that a detector is not required for now.

    Attributes:
        by: The operator; ``since`` when (Unix s).
        reason: The operator's reason; empty in records of an earlier iVeg.
        boot: Boot of the robot at that moment, None: no boot was known; another boot
            ends it.
    """

    by: str
    since: float
    boot: str | None = None
    reason: str = ""


@dataclass(slots=True)
class DetectorEvidence:
    """The evidence of one detector; moments are monotonic seconds.

    Attributes:
        whole_at: Lower bound of the measurement time of the newest frame that was read
            whole; None before the first, and while its age is unknown.
        flawed_at: Moment of the newest frame that was not read whole, by flaw.
        worked: Whether it was ever proven to work.
        out_of_service: None: it is required.
        words: Words by the detector's name, for the four names that came last.
        blind_by: Robot that sees a person whom this camera misses.
    """

    whole_at: float | None = None
    flawed_at: dict[Flaw, float] = field(default_factory=dict)
    worked: bool = False
    out_of_service: OutOfService | None = None
    words: dict[str, DetectorWords] = field(default_factory=dict)
    blind_by: str | None = None
    _allowance: float = FRAMES_HZ
    _counted_at: float | None = None

    def take_frame(
        self, judged: JudgedFrame, turned_away: int, unplaced: int, *, has_pose: bool
    ) -> Flaw | None:
        """Take a judged frame; returns its flaw, None: it was read whole.

        Args:
            judged: The frame; its detector is the newest from now on.
            turned_away: Detections for which there was no room.
            unplaced: Detections of somebody without a known place.
            has_pose: Whether the robot has ever sent a pose.
        """
        words = self._note_words(judged)
        if turned_away:
            return "overload"
        if judged.hides_somebody:
            return "unreadable"
        if unplaced:
            return "unreadable" if has_pose else "unplaced"
        return "strange" if words.is_strange else None

    def _note_words(self, judged: JudgedFrame) -> DetectorWords:
        """Add the words of a frame to those of its detector; returns these."""
        name = judged.frame.detector_name
        # Put at the end, so that the longest silent name gives way.
        words = self.words[name] = self.words.pop(name, DetectorWords())
        if len(self.words) > _MOST_NAMES:
            del self.words[next(iter(self.words))]
        words.is_understood |= judged.is_understood
        for word in judged.unknown:
            if len(words.unknown) < _MOST_UNKNOWN:
                words.unknown.setdefault(word)
        return words

    def admits_frame(self, now: Instant) -> bool:
        """Whether one more frame may be judged; counts it if so."""
        # All frames of a second may come at once, in a burst of a network.
        before = now.mono if self._counted_at is None else self._counted_at
        earned = FRAMES_HZ * max(0.0, now.mono - before)
        self._allowance = min(FRAMES_HZ, self._allowance + earned)
        self._counted_at = now.mono
        admitted = self._allowance >= 1.0
        self._allowance -= admitted
        return admitted

    def note_whole(self, measured_at: float | None) -> None:
        """Note a frame that was read whole; None: its age is unknown."""
        self.whole_at = measured_at
        self.worked = self.worked or measured_at is not None

    def note_flaw(self, flaw: Flaw, now: Instant) -> None:
        """Note a frame that was not read whole."""
        self.flawed_at[flaw] = now.mono

    def is_flawed(self, now: Instant, *, but: Flaw | None = None) -> bool:
        """Whether a frame was not read whole within the silence limit.

        ``but``: a flaw that does not count.
        """
        if not self.flawed_at:
            return False
        newest = [at for flaw, at in self.flawed_at.items() if flaw != but]
        return now.mono - max(newest, default=-math.inf) <= LIMITS.silence_s

    def is_missing(self, now: Instant) -> bool:
        """Whether nothing proves that it works; out of service it needs no proof.

        A refused frame counts even then: somebody may be in it.
        """
        if self.is_flawed(now):
            return True
        if self.out_of_service is not None:
            return False
        return self.whole_at is None or now.mono - self.whole_at > LIMITS.silence_s

    def meet_boot(self, boot: str | None) -> bool:
        """Note a boot; returns whether it puts the detector back in service."""
        ended = self.out_of_service
        if ended is None or boot is None or boot == ended.boot:
            return False
        self.out_of_service = None
        return True
