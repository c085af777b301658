"""Ground truth for the evaluation of detectors: targets in view of each camera."""

from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import orjson

from iveg.lab.emulator.camera import Target
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld


def in_view(
    rig: RobotHardware, world: SimulatedWorld
) -> Iterator[tuple[Target, float]]:
    """Targets in view of a robot's camera, with the visible share (0 to 1)."""
    for target in world.targets_for(rig.robot_id):
        part = rig.part_seen(target, world)
        if part > 0.0:
            yield target, part


class TruthLog:
    """Ground truth as one line of JSON per picture.

    ``{"robot", "at": Unix s, "pose": {"x", "y", "yaw"}, "speed", "visible": [{"key",
    "class", "x", "y", "part"}], "people": [{"key", "x", "y"}]}``: the robot's true pose
    in ``map`` (m, rad) and speed (m/s), all targets of which a part (0 to 1) is in its
    view, and every person in the greenhouse, by their true positions, whatever the
    detector reports.  Robots and people of all lines are enough to score protection.
    """

    def __init__(self, file: Path) -> None:
        self._file: TextIO = file.open("w", encoding="utf-8", buffering=1)

    def record(self, rig: RobotHardware, world: SimulatedWorld, at: float) -> None:
        """Record a robot's view at its picture (``at`` Unix s, by its own clock)."""
        visible = []
        for target, part in in_view(rig, world):
            pose = target.body.pose
            visible.append(
                {
                    "key": target.key,
                    "class": target.class_id,
                    "x": round(pose.x, 3),
                    "y": round(pose.y, 3),
                    "part": round(part, 2),
                }
            )
        true = rig.vehicle.pose
        picture = {
            "robot": rig.robot_id,
            "at": at,
            "pose": {
                "x": round(true.x, 3),
                "y": round(true.y, 3),
                "yaw": round(true.yaw, 4),
            },
            "speed": round(rig.vehicle.twist.linear_x, 3),
            "visible": visible,
            "people": [
                {"key": f"person-{number}", "x": round(one.x, 3), "y": round(one.y, 3)}
                for number, one in enumerate(world.discs())
            ],
        }
        self._file.write(orjson.dumps(picture).decode() + "\n")

    def close(self) -> None:
        """Close the file."""
        self._file.close()
