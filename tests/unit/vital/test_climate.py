"""The air of the greenhouse: told each time, kept once a minute."""

from iveg.domain.observations import Climate
from iveg.domain.records import ClimateRecord
from tests.unit.vital.desk import Desk


def reads(desk: Desk, at_s: float, temperature: float | None = 20.0) -> None:
    desk.clock.now = at_s
    desk.hear(Climate(temperature, 0.5, 400.0))


def kept(desk: Desk) -> list[ClimateRecord]:
    return [one for one in desk.sink.records if isinstance(one, ClimateRecord)]


def test_every_reading_is_told_and_one_a_minute_is_kept() -> None:
    desk = Desk()

    for at_s in range(0, 180, 10):
        reads(desk, float(at_s))

    assert desk.hub.versions["climate"] == 18
    begins = kept(desk)[0].at
    assert [one.at - begins for one in kept(desk)] == [0.0, 60.0, 120.0]
