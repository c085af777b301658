"""Sketches: quantiles within 1 % of exact, bounded, mergeable."""

import numpy as np
import pytest
from numpy.typing import NDArray

from iveg.domain.latency import SLICE_S, Series, Sketch, merged
from tests.data import latencies

SHARES = (0.5, 0.9, 0.95, 0.99)
SLICES_A_MINUTE = round(60 / SLICE_S)


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


def test_many_sketches_together_are_as_one_of_all_their_samples() -> None:
    values = latencies.recorded("robot_orion")

    whole = sketch_of(values)
    parts = merged(sketch_of(part) for part in np.array_split(values, 37))

    assert [parts.quantile(share) for share in SHARES] == [
        whole.quantile(share) for share in SHARES
    ]
    assert parts.count == whole.count
    assert parts.mean == pytest.approx(whole.mean)


def filled(minutes: int, each: float = 0.010) -> Series:
    """A series of one sample a slice; of minute m they are m + 1 times ``each``."""
    series = Series()
    for slice_ in range(minutes * SLICES_A_MINUTE):
        series.add(each * (slice_ // SLICES_A_MINUTE + 1))
        series.end_slice()
    return series


def test_a_window_holds_its_own_time_and_no_more() -> None:
    series = filled(minutes=130)

    counts = {
        window: merged(series.parts(window)).count
        for window in ("1min", "15min", "24h")
    }

    assert counts == {"1min": 6, "15min": 90, "24h": 780}
    assert merged(series.parts("1min")).mean == pytest.approx(1.30)


def test_what_is_older_than_a_day_is_forgotten() -> None:
    series = filled(minutes=25 * 60, each=0.001)

    assert merged(series.parts("24h")).count == 24 * 360
    assert merged(series.parts("24h")).quantile(0.0) == pytest.approx(0.061, rel=0.01)
