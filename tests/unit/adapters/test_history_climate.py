from iveg.adapters.history.climate import ClimateKeeper
from iveg.domain.observations import Climate, Instant, Received
from iveg.domain.records import ClimateRecord
from iveg.domain.world import World
from iveg.pipeline.publish import Hub
from tests.fakes.recorder import FakeRecorder


class House:
    """A keeper before a world that is told of readings."""

    def __init__(self) -> None:
        self.world, self.hub, self.recorder = World(("AGI",)), Hub(), FakeRecorder()
        self.keeper = ClimateKeeper(self.world, self.recorder, self.hub)

    def reads(self, at_s: float, temperature: float | None = 20.0) -> None:
        now = Instant(at_s, 1_000.0 + at_s)
        self.world.apply(Received(Climate(temperature, 0.5, 400.0), now, "orion"))
        self.keeper.look()

    @property
    def kept(self) -> list[float]:
        return [r.at for r in self.recorder.records if isinstance(r, ClimateRecord)]


def test_nothing_is_told_or_kept_before_the_first_reading() -> None:
    house = House()

    house.keeper.look()

    assert house.recorder.records == []
    assert house.hub.versions["climate"] == 0


def test_a_reading_is_kept_as_it_was() -> None:
    house = House()

    house.reads(0.0, temperature=None)

    assert house.recorder.records == [
        ClimateRecord(at=1_000.0, relative_humidity=0.5, co2=400.0)
    ]


def test_every_reading_is_told_and_one_a_minute_is_kept() -> None:
    house = House()

    for at_s in range(0, 180, 10):
        house.reads(float(at_s))

    assert house.hub.versions["climate"] == 18
    assert house.kept == [1_000.0, 1_060.0, 1_120.0]


def test_a_reading_is_told_once_however_often_it_is_looked_at() -> None:
    house = House()
    house.reads(0.0)

    house.keeper.look()

    assert house.hub.versions["climate"] == 1
    assert len(house.kept) == 1
