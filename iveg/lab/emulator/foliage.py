"""Leaves about a target's outline, which the mask network takes for the target.

Sizes of leaves are assumed.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.lab.emulator.greenhouse import Floats
from iveg.robot.grounding.cloud import Pinhole
from iveg.robot.grounding.mask import Mask


@dataclass(frozen=True, slots=True)
class Foliage:
    """Leaves about a target's outline that the mask network assigns to the target.

    Attributes:
        leaves: How many.
        least_radius: (m); ``most_radius`` (m).
        least_gap: How far behind or before the target they hang (m); ``most_gap`` (m).
        before: Share that hangs in front of the target and hides a part of it, 0 to 1.
    """

    leaves: int = 30
    least_radius: float = 0.01
    most_radius: float = 0.03
    least_gap: float = 0.2
    most_gap: float = 0.8
    before: float = 0.0


def hang_leaves(
    lens: Pinhole,
    foliage: Foliage,
    number: int,
    depth: Floats,
    instances: NDArray[np.int16],
    leaked: NDArray[np.int16],
    rng: np.random.Generator,
) -> None:
    """Hang leaves about one target's outline, each a disc that faces the camera."""
    rows, columns = np.nonzero(_outline(instances == number))
    if not rows.size:
        return
    for pick in rng.integers(0, rows.size, foliage.leaves):
        row, column = int(rows[pick]), int(columns[pick])
        gap = rng.uniform(foliage.least_gap, foliage.most_gap)
        side = -1.0 if rng.random() < foliage.before else 1.0
        away = max(depth[row, column] + side * gap, 0.3)
        radius = rng.uniform(foliage.least_radius, foliage.most_radius)
        leaf = _disc(depth.shape, row, column, radius / away * lens.focal)
        shows = leaf & (away < depth)
        depth[shows] = away
        instances[shows], leaked[shows] = 0, number


def _outline(mask: Mask) -> Mask:
    """Pixels of a mask that have one outside beside them."""
    wide = np.pad(mask, 1, constant_values=True)
    inner = wide[:-2, 1:-1] & wide[2:, 1:-1] & wide[1:-1, :-2] & wide[1:-1, 2:]
    return mask & ~inner


def _disc(shape: tuple[int, ...], row: int, column: int, radius: float) -> Mask:
    rows = np.arange(shape[0])[:, None] - row
    columns = np.arange(shape[1])[None, :] - column
    disc: Mask = rows**2 + columns**2 <= radius**2
    return disc
