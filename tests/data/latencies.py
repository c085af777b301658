"""What hops took for the sweeps of two emulated robots on a loaded machine."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

HOPS = ("uplink", "robot_orion", "iveg")


def recorded(hop: str) -> NDArray[np.float64]:
    """1,500 durations of a hop (s), in the order in which they were measured."""
    lines = Path(__file__).with_suffix(".txt").read_text().splitlines()
    found = {name: rest for name, _, rest in (line.partition(" ") for line in lines)}
    return np.array(found[hop].split(), np.float64) / 1e6
