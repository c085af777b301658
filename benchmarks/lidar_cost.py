"""What the emulated laser costs: ``python -m benchmarks.lidar_cost``.

One robot's sweep of 720 beams among the other robots and four people, and the same
with the bytes of its message, as share of one core at 30 Hz.
"""

import time
from collections.abc import Callable
from functools import partial

from iveg.adapters.greenhouses import load_greenhouse
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld
from iveg.ngsi.codec import write_measure

RATE_HZ = 30.0
ROUNDS, REPEATS = 5, 200
CASES = (
    ("mvsim-20x20", ("AGI", "AGII")),
    ("mvsim-20x20", tuple(f"R{n}" for n in range(10))),
    ("agroconnect", ("AGI", "AGII")),
    ("none", ("AGI", "AGII")),
)


def cost(work: Callable[[], object]) -> float:
    """CPU seconds of one call, the best of several rounds."""
    best = float("inf")
    for _ in range(ROUNDS):
        began = time.process_time()
        for _ in range(REPEATS):
            work()
        best = min(best, (time.process_time() - began) / REPEATS)
    return best


def message(rig: RobotHardware, world: SimulatedWorld) -> bytes:
    return write_measure(rig.scan(world))


def main() -> None:
    print("greenhouse    robots   sweep   with its message   core per robot at 30 Hz")
    for name, robots in CASES:
        greenhouse = load_greenhouse(name)
        layout = lay_out(scenario_named("demo"), robots, greenhouse)
        world = SimulatedWorld(greenhouse, layout, DETECTORS["simulation"], seed=1)
        rig = world.rigs[robots[0]]
        sweep = cost(partial(rig.scan, world))
        both = cost(partial(message, rig, world))
        print(
            f"{name:12} {len(robots):7} {sweep * 1e6:5.0f} µs {both * 1e6:12.0f} µs "
            f"{both * RATE_HZ:18.1%}"
        )


if __name__ == "__main__":
    main()
