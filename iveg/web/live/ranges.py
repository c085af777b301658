"""Ranges of a scan as the integers that a browser draws."""

from typing import Final

import numpy as np

from iveg.domain.observations import LaserScan

UNIT_M: Final = 0.005
"""Unit of a range: finer than a map shows, and 327 m fit in 16 bits."""
NO_RETURN: Final = 0xFFFF


def write_ranges(scan: LaserScan) -> bytes:
    """Ranges as ``uint16`` in ``UNIT_M``, little-endian, padded to four bytes."""
    ranges = scan.ranges
    units = np.full(ranges.size + ranges.size % 2, NO_RETURN, "<u2")
    counts = scan.returns() & (ranges < UNIT_M * NO_RETURN)
    units[: ranges.size][counts] = np.rint(ranges[counts] / UNIT_M)
    return units.tobytes()
