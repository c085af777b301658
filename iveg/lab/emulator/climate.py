"""The climate of the simulated greenhouse."""

import math

from iveg.domain.observations import Climate

_DAY_S = 86_400.0


def climate_at(wall: float) -> Climate:
    """Climate at a time of day (Unix s): warm and dry at 14 h UTC, humid at night.

    Typical of a Mediterranean greenhouse in spring; CO₂ falls while the crop works.
    """
    warmth = math.cos((wall % _DAY_S - 14 * 3600.0) / _DAY_S * math.tau)
    return Climate(
        temperature=round(22.0 + 6.0 * warmth, 2),
        relative_humidity=round(0.70 - 0.12 * warmth, 3),
        co2=round(430.0 - 60.0 * warmth, 1),
    )
