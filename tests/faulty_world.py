"""The emulator's world with faults of robots, each as a test orders it."""

from dataclasses import dataclass, replace

import numpy as np
import orjson

from iveg.domain.geometry import REST, Twist2D
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.stamps import format_stamp, parse_stamp
from iveg.lab.emulator.camera import PERSON, DetectorModel, Target, person_target
from iveg.lab.emulator.greenhouse import Disc
from iveg.lab.emulator.layout import Layout
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld


@dataclass(frozen=True, slots=True)
class Faults:
    """``mute``: nothing that it publishes arrives; ``deaf``: its base obeys navigation
    instead of its gate, except for a halt; ``thing``: a thing there (m) is taken for a
    person; ``hide_people``: its camera detects none."""

    mute: bool = False
    deaf: bool = False
    clock_offset_s: float = 0.0
    thing: tuple[float, float] | None = None
    hide_people: bool = False


class FaultyRig(RobotHardware):
    faults, requested = Faults(), REST

    def requested_twist(self, now: float, around: SimulatedWorld) -> Twist2D:
        self.requested = super().requested_twist(now, around)
        return self.requested

    def drive(self, command: Twist2D) -> None:
        ignores = self.faults.deaf and command != REST
        super().drive(self.requested if ignores else command)


class FaultyWorld(SimulatedWorld):
    """The same world, with the same noise, whose robots may have faults."""

    def __init__(
        self, place: Greenhouse, layout: Layout, model: DetectorModel, seed: int
    ) -> None:
        super().__init__(place, layout, model, seed)
        self.faulty: dict[str, FaultyRig] = {}
        streams = np.random.SeedSequence(seed).spawn(len(layout.robots))
        for (name, script), stream in zip(layout.robots.items(), streams, strict=True):
            profile, rng = layout.profiles[name], np.random.default_rng(stream)
            self.faulty[name] = FaultyRig(name, profile, script, model, rng)
        self.rigs = self.faulty

    def happen(self, robot_id: str, faults: Faults) -> None:
        """Give a robot these faults in place of those that it has."""
        self.faulty[robot_id].faults = faults

    def targets_for(self, robot_id: str) -> list[Target]:
        targets, faults = super().targets_for(robot_id), self.faulty[robot_id].faults
        if faults.hide_people:
            targets = [target for target in targets if target.class_id != PERSON]
        if faults.thing is not None:
            thing = person_target(0, Disc(*faults.thing, 0.2))
            targets.append(replace(thing, key="thing"))
        return targets

    def sent(self, topic: str, payload: bytes) -> bytes | None:
        """A message of a robot as its faults let it out; None for none."""
        _, first, second, *_ = topic.split("/")
        sender = second.partition("_")[0] if first == "iveg" else first
        faults = self.faulty[sender].faults
        stamp: str = orjson.loads(payload)["TimeInstant"]
        wrong = format_stamp((parse_stamp(stamp) or 0.0) + faults.clock_offset_s)
        return None if faults.mute else payload.replace(stamp.encode(), wrong.encode())
