"""Ground truth: where everybody is, who is in view, and how robots may drive."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import orjson

from iveg.domain.geometry import Pose2D
from iveg.lab.emulator.greenhouse import Disc
from iveg.lab.emulator.targets import Target
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld


@dataclass(frozen=True, slots=True)
class Driving:
    """How a robot may drive.

    Attributes:
        wanted: Speed that its navigation asks for (m/s); 0 while it is held.
        factor: Greatest share of it that its own safety machine allows (0 to 1).
    """

    wanted: float
    factor: float


def in_view(
    rig: RobotHardware, world: SimulatedWorld
) -> Iterator[tuple[Target, float]]:
    """Targets in view of a robot's camera, with the visible share (0 to 1)."""
    for target in world.targets_for(rig.robot_id):
        part = rig.part_seen(target, world)
        if part > 0.0:
            yield target, part


def true_picture(
    rig: RobotHardware, world: SimulatedWorld, at: float, driving: Driving
) -> dict[str, object]:
    """The truth of one picture.

    ``{"robot", "at": Unix s, "pose": {"x", "y", "yaw"}, "speed", "wanted", "factor",
    "visible": [{"key", "class", "x", "y", "part"}], "people": [{"key", "x", "y",
    "hidden"}], "robots": [{"key", "x", "y", "yaw"}]}``: the robot's true pose in
    ``map`` (m, rad) and speed (m/s), ``Driving``, all targets of which a part (0 to 1)
    is in its view, and every person and robot in the greenhouse, by their true
    positions, whatever the detector reports; ``hidden``: crop or crates are between
    this robot's ``base_link`` and the person.

    Args:
        rig: The robot whose picture it is.
        world: Everybody.
        at: When the picture was taken (Unix s, by the robot's own clock).
        driving: How it may drive then.
    """
    pose = rig.vehicle.pose
    return {
        "robot": rig.robot_id,
        "at": at,
        "pose": _pose(pose),
        "speed": round(rig.vehicle.twist.linear_x, 3),
        "wanted": round(driving.wanted, 3),
        "factor": driving.factor,
        "visible": [
            {
                "key": target.key,
                "class": target.class_id,
                **_place(target.body.pose),
                "part": round(part, 2),
            }
            for target, part in in_view(rig, world)
        ],
        "people": [
            {
                "key": f"person-{number}",
                **_place(one),
                "hidden": world.scenery.hides(pose.x, pose.y, one.x, one.y),
            }
            for number, one in enumerate(world.discs())
        ],
        "robots": [
            {"key": one.robot_id, **_pose(one.vehicle.pose)}
            for one in world.rigs.values()
        ],
    }


def _place(of: Pose2D | Disc) -> dict[str, float]:
    return {"x": round(of.x, 3), "y": round(of.y, 3)}


def _pose(of: Pose2D) -> dict[str, float]:
    return {**_place(of), "yaw": round(of.yaw, 4)}


class TruthLog:
    """Ground truth as one line of JSON per picture; see ``true_picture``."""

    def __init__(self, file: Path) -> None:
        self._file: TextIO = file.open("w", encoding="utf-8", buffering=1)

    def record(
        self, rig: RobotHardware, world: SimulatedWorld, at: float, driving: Driving
    ) -> None:
        """Record a robot's view at its picture; arguments are ``true_picture``'s."""
        row = true_picture(rig, world, at, driving)
        self._file.write(orjson.dumps(row).decode() + "\n")

    def close(self) -> None:
        """Close the file."""
        self._file.close()
