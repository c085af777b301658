"""What an emulated robot costs: ``python -m benchmarks.emulator_cost``.

CPU of one robot's three slots (drive and odometry, laser, camera) and of the people,
with the bytes of its messages, as share of one core at 30 Hz.  The broker's line is
left out; ``benchmarks.soak`` measures whole programs.
"""

import time

from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.geometry import Twist2D
from iveg.domain.observations import Instant
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import SimulatedWorld
from iveg.robot.uplink import Origins, Uplink

RATE_HZ = 30.0
SECONDS = 20
CASES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("mvsim-20x20", ("AGI", "AGII")),
    ("mvsim-20x20", tuple(f"R{n}" for n in range(10))),
    ("agroconnect", ("AGI", "AGII")),
    ("none", tuple(f"R{n}" for n in range(20))),
)


def spent(world: SimulatedWorld) -> dict[str, float]:
    """CPU seconds of each part over ``SECONDS`` of the world's own time."""
    parts = dict.fromkeys(("people", "drive", "laser", "camera"), 0.0)
    uplinks = {
        robot_id: Uplink(robot_id, "iveg", Origins("b00t"), lambda *_: None)
        for robot_id in world.rigs
    }

    def timed(part: str, began: float) -> float:
        now = time.process_time()
        parts[part] += now - began
        return now

    for tick in range(round(SECONDS * RATE_HZ)):
        now = tick / RATE_HZ
        at = time.process_time()
        world.walk(1.0 / RATE_HZ)
        at = timed("people", at)
        for robot_id, rig in world.rigs.items():
            uplink = uplinks[robot_id]
            wish = rig.requested_twist(now, world)
            rig.drive(wish if tick > RATE_HZ else Twist2D(0.0, 0.0))
            rig.move(1.0 / RATE_HZ)
            uplink.send(rig.odometry(), Instant(now, now))
            at = timed("drive", at)
            uplink.send(rig.scan(world), Instant(now, now))
            at = timed("laser", at)
            uplink.send(rig.detect(now, world), Instant(now, now))
            at = timed("camera", at)
    return parts


def main() -> None:
    parts_named = "people    drive    laser   camera   core per robot"
    print(f"greenhouse     robots   {parts_named}")
    for name, robots in CASES:
        greenhouse = load_greenhouse(name)
        layout = lay_out(scenario_named("demo"), robots, greenhouse)
        world = SimulatedWorld(greenhouse, layout, DETECTORS["simulation"], 1)
        parts = spent(world)
        each = [one / SECONDS / len(robots) for one in parts.values()]
        shares = "".join(f"{share:9.2%}" for share in each)
        print(f"{name:12} {len(robots):7} {shares} {sum(each):14.2%}")


if __name__ == "__main__":
    main()
