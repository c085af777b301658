"""Sketches: quantiles within 1 % of exact, bounded, mergeable."""

import numpy as np
import pytest
from numpy.typing import NDArray

from iveg.domain.latency import SLICE_S, Series, Sketch, Window, merged
from tests.data import latencies

SHARES = (0.5, 0.9, 0.95, 0.99)
SLICES_A_MINUTE = round(60 / SLICE_S)
WINDOWS: tuple[Window, ...] = "1min", "15min", "24h"


def sketch_of(values: NDArray[np.float64]) -> Sketch:
    sketch = Sketch()
    for value in values.tolist():
        sketch.add(value)
    return sketch


def exact(values: NDArray[np.float64], share: float) -> float:
    return float(np.quantile(values, share, method="lower"))


@pytest.mark.parametrize("hop", latencies.HOPS)
def test_quantiles_of_recorded_samples_are_within_one_percent(hop: str) -> None:
    values = latencies.recorded(hop)

    sketch = sketch_of(values)

    for share in SHARES:
        assert sketch.quantile(share) == pytest.approx(exact(values, share), rel=0.01)


def filled(minutes: int, each: float) -> Series:
    """A series of one sample a slice; of minute m they are m + 1 times ``each``."""
    series = Series()
    for slice_ in range(minutes * SLICES_A_MINUTE):
        series.add(each * (slice_ // SLICES_A_MINUTE + 1))
        series.end_slice()
    return series


def test_a_window_holds_its_own_time_and_no_more() -> None:
    series = filled(minutes=25 * 60, each=0.001)

    minute, quarter, day = (merged(series.parts(one)) for one in WINDOWS)

    assert (minute.count, quarter.count, day.count) == (6, 90, 24 * 360)
    assert minute.mean == pytest.approx(1.500)
    # The first hour is forgotten.
    assert day.quantile(0.0) == pytest.approx(0.061, rel=0.01)
