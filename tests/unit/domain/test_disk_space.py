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


def test_what_was_low_is_low_until_it_is_well_again() -> None:
    free = [GB - 1, GB + 1, int(1.2 * GB) - 1, int(1.2 * GB), GB + 1, GB - 1]
    low, found = False, []
    for one in free:
        low = DiskSpace(one, 500 * GB).is_low(was_low=low)
        found.append(low)

    assert found == [True, True, True, False, False, True]


def test_a_low_disk_is_a_p2_that_says_how_much_is_left() -> None:
    [condition] = DiskSpace(300_000_000, 500 * GB).conditions(was_low=False)

    assert (condition.priority, condition.key) == ("P2", "alert.disk_low")
    assert condition.slots == {"free_mb": 300, "least_mb": 1000}
    assert [*DiskSpace(2 * GB, 500 * GB).conditions(was_low=True)] == []
