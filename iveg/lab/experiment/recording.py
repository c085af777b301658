"""What is known of one half of a run, virtual or real."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import orjson

from iveg.domain.geometry import Pose2D
from iveg.domain.records import Json
from iveg.domain.stamps import parse_stamp
from iveg.lab.emulator.greenhouse import into
from iveg.lab.experiment.beliefs import Belief, InjectionQuestion, questions
from iveg.lab.experiment.plan import WATCHED
from iveg.lab.experiment.scoring import Pair, Picture, SeenObject, paired

Row = Json


@dataclass(slots=True)
class RunRecording:
    """One half of a run.

    Attributes:
        truth: The emulator's rows, one a picture (``emulator.truth.true_picture``).
        reported: Detection frames as iVeg told them.
        foretold: Encounters with people as iVeg told them at each picture
            (``moments.moments_of``); the virtual half alone has them.
        beliefs: Content of a robot's costmap at some moments (s, by the clock of the
            pictures).
        decisions: Each with ``reason``, ``applied_at``, ``observed_at``, ``in_sight``.
        completed: Whether it reached its end with all robots live and unharmed.
        failures: Why not, in a word each; the virtual half alone has them.
    """

    truth: list[Row] = field(default_factory=list)
    reported: list[Picture] = field(default_factory=list)
    foretold: list[Row] = field(default_factory=list)
    beliefs: list[tuple[float, Belief]] = field(default_factory=list)
    decisions: list[Row] = field(default_factory=list)
    completed: bool = False
    failures: list[str] = field(default_factory=list)

    @property
    def measured(self) -> list[Row]:
        """The truth while it was measured."""
        return self.truth

    @property
    def views(self) -> list[Picture]:
        """True pictures."""
        return [picture_of_truth(row) for row in self.truth]

    @property
    def pairs(self) -> list[Pair]:
        """True and told pictures of one moment."""
        return list(paired(self.views, self.reported))

    @property
    def asked(self) -> list[InjectionQuestion]:
        """The watched robot's costmap, asked for people out of its sight."""
        return list(questions(self.views, self.beliefs, WATCHED))


def read_truth(file: Path) -> list[Row]:
    """Ground truth of the emulator; an incomplete last line is omitted."""
    rows = []
    for line in file.read_bytes().splitlines():
        try:
            rows.append(orjson.loads(line))
        except orjson.JSONDecodeError:
            continue
    return rows


def picture_of_truth(row: Row) -> Picture:
    """One true picture, in ``map`` and in the robot's frame."""
    pose = Pose2D(**row["pose"])
    seen = tuple(
        SeenObject(
            one["key"],
            one["class"],
            one["x"],
            one["y"],
            local=into(pose, one["x"], one["y"]),
        )
        for one in row["visible"]
    )
    return Picture(row["robot"], row["at"], seen)


def picture_of(frame: Row, at: float | None = None) -> Picture | None:
    """One detection frame of the live topic; None without a readable stamp.

    Args:
        frame: As iVeg told it.
        at: When it was taken, where that is known without its stamp (s).
    """
    at = parse_stamp(frame["stamp"] or "") if at is None else at
    if at is None:
        return None
    return Picture(frame["robot_id"], at, _seen_in(frame["items"]))


def _seen_in(items: Sequence[Row]) -> tuple[SeenObject, ...]:
    return tuple(
        SeenObject(
            str(place),
            one["class_id"],
            one["position"]["x"],
            one["position"]["y"],
            one["probability"],
            _centre(one["box"]),
        )
        for place, one in enumerate(items)
    )


def _centre(box: Row | None) -> tuple[float, float] | None:
    """Centre of a box in the robot's frame; None where it was told in another."""
    if box is None or box["frame_id"] != "base_link":
        return None
    return (box["xmin"] + box["xmax"]) / 2, (box["ymin"] + box["ymax"]) / 2
