"""Sketches: quantiles within 1 % of exact, bounded, mergeable."""

import numpy as np
import pytest
from numpy.typing import NDArray

from iveg.domain.latency import Series, Sketch, merged
from tests.data import latencies

SHARES = (0.5, 0.9, 0.95, 0.99)


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


def test_a_series_holds_fifteen_minutes_and_the_one_that_goes_on() -> None:
    series = Series()
    for minute in range(60):
        series.add(0.001 * minute)
        series.end_slice()
    series.add(0.060)

    kept = merged(series.parts())

    assert (series.count, kept.count) == (61, 16)
    assert kept.quantile(0.0) == pytest.approx(0.045, rel=0.01)
