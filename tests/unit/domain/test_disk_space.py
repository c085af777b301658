"""When a disk is low, and when it is well again."""

import pytest

from iveg.domain.retention import DiskSpace

GB = 10**9


@pytest.mark.parametrize(
    ("free", "total", "low"),
    [
        (GB, 500 * GB, False),
        (GB - 1, 500 * GB, True),
        (GB // 2, 10 * GB, False),
        (GB // 2 - 1, 10 * GB, True),
        (0, 0, False),
    ],
)
def test_low_is_below_the_lesser_of_a_gigabyte_and_a_twentieth(
    free: int, total: int, low: bool
) -> None:
    assert DiskSpace(free, total).is_low(was_low=False) is low
