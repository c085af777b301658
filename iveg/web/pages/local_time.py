"""The greenhouse's clock: Europe/Madrid on paper and screen, UTC in data.

Central European time with the summer time of Directive 2000/84/EC, so that no table of
time zones must be installed.
"""

from datetime import UTC, date, datetime, timedelta

_HOUR = timedelta(hours=1)


def in_madrid(at: float) -> datetime:
    """A moment (Unix s) on the wall clock; the value holds no zone."""
    moment = datetime.fromtimestamp(at, UTC).replace(tzinfo=None)
    return moment + (2 * _HOUR if _is_summer(moment) else _HOUR)


def local_stamp(at: float) -> str:
    """A moment (Unix s) on the wall clock, to the second."""
    return f"{in_madrid(at):%Y-%m-%d %H:%M:%S}"


def start_of(day: date) -> float:
    """When a day begins there (Unix s); clocks never change at midnight."""
    midnight = datetime(day.year, day.month, day.day)  # noqa: DTZ001 - a wall clock
    ahead = 2 * _HOUR if _is_summer(midnight - _HOUR) else _HOUR
    return (midnight - ahead).replace(tzinfo=UTC).timestamp()


def moment_of(wall: datetime) -> float:
    """When the wall clock there shows a time (Unix s); the first of two in October."""
    ahead = 2 * _HOUR if _is_summer(wall - 2 * _HOUR) else _HOUR
    return (wall - ahead).replace(tzinfo=UTC).timestamp()


def _is_summer(moment: datetime) -> bool:
    """From the last Sunday of March to that of October, both at 01:00 UTC."""
    return _last_sunday(moment.year, 3) <= moment < _last_sunday(moment.year, 10)


def _last_sunday(year: int, month: int) -> datetime:
    last = datetime(year, month, 31, 1)  # noqa: DTZ001 - UTC, as its callers have it
    return last - timedelta(days=(last.weekday() + 1) % 7)
