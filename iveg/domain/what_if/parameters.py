"""What may be tried in place of the rule in force, and how far it reaches."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from iveg.domain.limits import LIMITS, ring_radius
from iveg.domain.rule.paths import HORIZON_S
from iveg.domain.what_if.inputs import Floats


@dataclass(frozen=True, slots=True)
class Parameters:
    """What may be tried.

    Attributes:
        threshold: Least confidence of a person; ``robot_threshold`` of a robot.
        radius_m: Ring of a fresh sighting (m).
        release_beyond_m: So far outside a robot is let go (m), ``release_after_s`` and
            so long after (s).
        factor: Speed inside a ring, as a share.
        foresight_s: How far ahead it looks (s); 0: not at all.
    """

    threshold: float = LIMITS.detection_threshold
    robot_threshold: float = LIMITS.detection_threshold
    radius_m: float = LIMITS.ring_default_m
    release_beyond_m: float = LIMITS.release_beyond_m
    release_after_s: float = LIMITS.release_after_s
    factor: float = LIMITS.slow_factor
    foresight_s: float = HORIZON_S


def widest(tried: Collection[Parameters]) -> Parameters:
    """One of the same radius that holds robots wherever one of these does."""
    return replace(
        next(iter(tried)),
        foresight_s=max(one.foresight_s for one in tried),
        release_beyond_m=max(one.release_beyond_m for one in tried),
    )


def reach_m(tried: Parameters, age: Floats, speed: Floats) -> Floats:
    """How far from its middle a ring may matter to a robot (m).

    Args:
        tried: Parameters.
        age: Of rings (s).
        speed: Of both towards each other, at most (m/s).
    """
    radius = ring_radius(tried.radius_m, age, np.minimum, np.maximum)
    goes_on = tried.foresight_s + np.minimum(age, LIMITS.seen_s)
    ahead = speed * goes_on * (age <= LIMITS.seen_s)
    reach: Floats = radius + np.maximum(tried.release_beyond_m, ahead) + 1e-6
    return reach
