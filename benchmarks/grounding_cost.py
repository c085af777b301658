"""What grounding costs a robot's computer: ``python -m benchmarks.grounding_cost``.

One detection in a 640 × 480 picture, from its bitset to a box in ``base_link``, for a
person with leaves about the outline; and the share of it that is erosion.  What the
emulator spends on the picture is told too: a real robot has a camera for that.
"""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from iveg.adapters.fleet_files import built_in
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Origin
from iveg.lab.emulator.depth import DepthView, person_shape, take_picture
from iveg.lab.emulator.depth_camera import DepthCamera
from iveg.lab.emulator.foliage import Foliage
from iveg.lab.emulator.greenhouse import Disc, Scenery
from iveg.robot.grounding.locate import Mount, body_of, ground_frame

ROUNDS, REPEATS = 5, 20
DISTANCES_M = (1.5, 3.0, 6.0)
AISLE = Scenery.of(
    Greenhouse(
        "aisle",
        Rectangle(-20.0, -20.0, 20.0, 20.0),
        rows=(Rectangle(-2.0, 1.2, 12.0, 1.8), Rectangle(-2.0, -1.8, 12.0, -1.2)),
    )
)

AGI = built_in().of_robot("AGI").profile


def cost(work: Callable[[], object]) -> float:
    """CPU seconds of one call, the best of several rounds."""
    best = float("inf")
    for _ in range(ROUNDS):
        began = time.process_time()
        for _ in range(REPEATS):
            work()
        best = min(best, (time.process_time() - began) / REPEATS)
    return best


def picture(ahead: float) -> DepthView:
    person = person_shape(Disc(AGI.camera.x + ahead, 0.0, 0.25))
    rng = np.random.default_rng(1)
    return take_picture(
        DepthCamera.of(AGI), AGI.camera, [person], AISLE, Foliage(), rng
    )


def main() -> None:
    print("person at   mask (pixels)   detection   of it erosion   emulated picture")
    for ahead in DISTANCES_M:
        view = picture(ahead)
        segment = view.segment(1, "farmer", 0.9)
        if segment is None:
            raise SystemExit("The person is not in the picture.")
        mount = Mount.of(AGI)
        whole = cost(
            partial(ground_frame, "AGI", Origin(), [segment], view.depth, mount)
        )
        erosion = cost(partial(body_of, segment))
        print(
            f"{ahead:7.1f} m {segment.width:8} × {segment.height:3} "
            f"{whole * 1e3:9.2f} ms {erosion * 1e3:12.2f} ms "
            f"{cost(partial(picture, ahead)) * 1e3:15.1f} ms"
        )


if __name__ == "__main__":
    main()
