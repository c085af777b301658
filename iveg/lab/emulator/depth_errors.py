"""Errors of a depth picture: noise that neighbours share, and holes."""

import math

import numpy as np
from numpy.typing import NDArray

from iveg.lab.emulator.depth_camera import DepthCamera
from iveg.lab.emulator.greenhouse import Floats

_NOISE_PATCH = 8
"""Pixels across: stereo matches windows, so neighbours err together."""


def with_errors(
    camera: DepthCamera, depth: Floats, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Depth with its errors; 0 where nothing was measured."""
    scale = camera.disparity_error / (camera.lens.focal * camera.baseline)
    measured = depth + depth**2 * scale * _patches(depth.shape, rng)
    lost = rng.random(depth.shape) < camera.dropouts
    measured[lost | (depth > camera.most) | (measured < 0.0)] = 0.0
    return measured.astype(np.float32)


def _patches(shape: tuple[int, ...], rng: np.random.Generator) -> Floats:
    """Normal noise that neighbours share: drawn every few pixels, linear between."""
    rows, columns = shape[0] / _NOISE_PATCH, shape[1] / _NOISE_PATCH
    knots = rng.normal(0.0, 1.0, (math.ceil(rows) + 1, math.ceil(columns) + 1))
    return _between(_between(knots, shape[0]).T, shape[1]).T


def _between(knots: Floats, count: int) -> Floats:
    """Linear between rows of knots; shape (count, …)."""
    at = np.arange(count) / _NOISE_PATCH
    below = at.astype(int)
    share = (at - below)[:, None]
    between: Floats = knots[below] * (1.0 - share) + knots[below + 1] * share
    return between
