"""Messages timed at their hops: a delay lands in the hop that has it, nowhere else."""

from dataclasses import replace

import pytest

from iveg.domain.latency.segments import DATA, SEGMENTS, Segment
from iveg.domain.latency.sketch import sketch_of
from iveg.domain.latency.watch import LatencyWatch
from iveg.domain.observations import Odometry, Origin
from iveg.domain.transports import DIRECT, FIWARE
from tests.builders import odometry, origin, received
from tests.unit.domain.chain import Chain, jittered, still

CALM: dict[Segment, float] = {
    "uplink": 0.004,
    "fiware": 0.020,
    "robot_orion": 0.024,
    "iveg": 0.001,
    "screen": 0.010,
}


def close(seconds: float) -> object:
    """Within 10 ms or 10 %, the larger."""
    return pytest.approx(seconds, abs=0.010, rel=0.10)


def test_every_message_is_measured_at_every_hop() -> None:
    chain = Chain()

    chain.run(10.0)

    took = {(hop, data): chain.took(hop, data) for hop in SEGMENTS for data in DATA}
    assert {place: one.count for place, one in took.items()} == {
        place: pytest.approx(199, abs=1) for place in took
    }
    assert {place: one.mean for place, one in took.items()} == {
        (hop, data): pytest.approx(CALM[hop], abs=0.001) for hop, data in took
    }


@pytest.mark.parametrize(
    ("chain", "hop", "seconds"),
    [
        (Chain(up=still(0.054)), "uplink", 0.054),
        (Chain(agent=still(0.140)), "fiware", 0.140),
        (Chain(iveg=still(0.060)), "iveg", 0.060),
        (Chain(page=still(0.090)), "screen", 0.090),
    ],
)
def test_a_delay_that_is_put_in_is_found_in_its_hop_alone(
    chain: Chain, hop: Segment, seconds: float
) -> None:
    chain.run(10.0)

    expected = CALM | {hop: seconds}
    expected["robot_orion"] = expected["uplink"] + expected["fiware"]
    assert {one: chain.took(one).mean for one in SEGMENTS} == {
        one: close(expected[one]) for one in SEGMENTS
    }


@pytest.mark.parametrize("hop", ["up", "agent"])
def test_jitter_of_300_ms_is_found_as_spread_of_its_hop(hop: str) -> None:
    chain = Chain(**{hop: jittered(0.004, 0.304)})  # type: ignore[arg-type]

    chain.run(30.0)

    took = chain.took("uplink" if hop == "up" else "fiware")
    assert took.mean == close(0.154)
    assert took.quantile(0.95) == close(0.289)
    assert took.quantile(0.05) == close(0.019)


def test_without_direct_reading_both_ways_are_one_number() -> None:
    chain = Chain(direct=False)

    chain.run(5.0)

    assert chain.took("robot_orion").mean == pytest.approx(0.024, abs=0.001)
    assert chain.took("uplink").count == 0
    assert chain.took("fiware").count == 0


def test_a_way_whose_parting_nobody_saw_is_a_total_alone() -> None:
    chain = Chain(reading=still(0.030))

    chain.run(5.0)

    assert chain.took("fiware").count == chain.took("uplink").count == 0
    assert chain.took("robot_orion").mean == pytest.approx(0.024, abs=0.001)
    assert chain.stream().orion_first >= 97


def test_a_throttled_hop_is_a_sample_and_says_so() -> None:
    chain = Chain(thinned=True, lost_agent=lambda seq: seq % 20 != 0)

    chain.run(20.0)

    assert chain.took("fiware").count == pytest.approx(20, abs=1)
    assert chain.stream().is_throttled
    assert chain.stream().fiware.missing == 0


def test_the_rates_say_what_really_comes() -> None:
    chain = Chain(lost_agent=lambda seq: seq % 2 == 0)

    chain.run(10.0)

    rates = chain.stream().rates
    assert (rates.heard, rates.agent, rates.orion) == pytest.approx((20, 20, 10), abs=1)


@pytest.mark.parametrize(
    ("written", "why"),
    [
        (lambda one: replace(one, stamp_s=None), "no_stamp"),
        (lambda one: replace(one, stamp_s=1.7e9), "repeated_stamp"),
    ],
)
def test_a_robot_without_usable_stamps_is_counted_and_gives_no_uplink(
    written: object, why: str
) -> None:
    chain = Chain(written=written)  # type: ignore[arg-type]

    chain.run(5.0)

    assert chain.took("uplink").count <= 1
    assert chain.stream().excluded["uplink", why] >= 98  # type: ignore[index]
    assert chain.took("fiware").mean == pytest.approx(0.020, abs=0.001)


def an_hour_off_from(second: float, hours: float) -> object:
    def write(origin: Origin) -> Origin:
        late = origin.mono is not None and origin.mono >= second
        stamp = origin.stamp_s or 0.0
        return replace(origin, stamp_s=stamp + 3600.0 * hours) if late else origin

    return write


@pytest.mark.parametrize("hours", [-1, 1])
def test_a_clock_that_jumps_an_hour_never_shows_as_latency(hours: int) -> None:
    chain = Chain(written=an_hour_off_from(5.0, hours))  # type: ignore[arg-type]

    chain.run(10.0)

    jumped = sum(chain.stream(one).excluded["uplink", "clock_jump"] for one in DATA)
    assert jumped == 5
    assert chain.watch.clocks["AGI"].jumps == 1
    assert chain.took("uplink").most < 0.1
    assert chain.took("uplink").least >= 0.0


def test_a_message_that_comes_twice_counts_once() -> None:
    chain = Chain()
    chain.run(5.0)
    before = chain.took("uplink").count

    chain.watch.arrived(chain.last(DIRECT.id))
    chain.watch.arrived(chain.last(FIWARE.id))

    assert chain.took("uplink").count == before
    assert chain.stream("lidar").up.repeated == 1
    assert chain.stream("lidar").fiware.repeated == 1


def test_a_page_that_paints_before_the_decision_is_excluded() -> None:
    chain = Chain(page=still(-0.5))

    chain.run(5.0)

    assert chain.took("screen").count == 0
    assert chain.stream().excluded["screen", "negative"] > 90


def test_one_message_can_be_followed_through_every_hop() -> None:
    chain = Chain()

    chain.run(10.0)

    trace = chain.stream().tracer.newest
    assert trace is not None
    assert trace.uplink_s == pytest.approx(0.004, abs=0.001)
    assert (trace.notified_at or 0) - trace.heard_at == pytest.approx(0.020)
    assert (trace.decided_at or 0) - trace.heard_at == pytest.approx(0.001)
    assert (trace.painted_at or 0) - (trace.decided_at or 0) == pytest.approx(0.010)


def test_a_minute_that_is_over_is_handed_on_for_the_history() -> None:
    chain = Chain()

    chain.run(75.0)

    ended = {(data, hop): sketch for _, (_, data, hop, sketch) in chain.watch.ended}
    assert set(ended) == {(data, hop) for data in DATA for hop in SEGMENTS}
    assert ended["lidar", "fiware"].count == pytest.approx(1200, abs=25)


def test_an_earlier_runs_hours_are_part_of_the_day() -> None:
    chain = Chain()

    chain.watch.remember([("AGI", "lidar", "fiware", sketch_of([0.5] * 7))])

    parts = chain.stream("lidar").segments["fiware"].parts("24h")
    assert sum(one.count for one in parts) == 7


def test_a_robot_that_starts_again_is_matched_by_its_new_boot() -> None:
    chain = Chain(
        written=lambda one: replace(one, boot="a" if (one.mono or 0) < 5 else "c")
    )

    chain.run(10.0)

    assert chain.took("fiware").mean == pytest.approx(0.020, abs=0.001)
    assert chain.took("fiware").count >= 190
    assert chain.stream().up.missing == 0


# --- overload -------------------------------------------------------------------------


def test_an_agent_that_falls_behind_is_named_within_three_seconds() -> None:
    chain = Chain()
    chain.run(10.0)

    chain.agent = still(1.7)
    chain.run(3.0)

    said = chain.said()
    assert list(said) in (["latency.overloads.fiware"], ["latency.growing.fiware"])
    assert [slots["lag"] for slots in said.values()] == [pytest.approx(1.7, abs=0.15)]


def test_a_robot_whose_way_up_falls_behind_is_named_within_three_seconds() -> None:
    chain = Chain(robots=("AGI", "AGII"))
    chain.run(10.0)

    chain.up = still(1.4)
    chain.run(3.0)

    assert set(chain.said()) & {"latency.overloads.uplink", "latency.growing.uplink"}


def test_a_hop_that_has_caught_up_is_named_no_more() -> None:
    chain = Chain(agent=still(1.7))
    chain.run(10.0)

    chain.agent = still(0.02)
    chain.run(7.0)

    assert chain.said() == {}


def test_a_lag_that_grows_says_so() -> None:
    chain = Chain()
    chain.run(5.0)
    for tenth in range(40):
        chain.agent = still(0.1 * tenth)
        chain.run(0.1)

    assert "latency.growing.fiware" in chain.said()


@pytest.mark.parametrize(
    ("fault", "key"),
    [
        ("lost_up", "latency.lost.uplink"),
        ("lost_agent", "latency.lost.fiware"),
    ],
)
def test_loss_is_named_at_its_hop_within_three_seconds(fault: str, key: str) -> None:
    chain = Chain()
    chain.run(10.0)

    setattr(chain, fault, lambda seq: seq % 4 == 0)
    chain.run(3.0)

    said = chain.said()
    assert set(said) == {key}
    assert said[key]["share"] == pytest.approx(0.2, abs=0.08)


def test_what_newer_ones_overtook_before_it_was_read_is_not_lost() -> None:
    watch = LatencyWatch(["AGI"])
    watch.arrived(received(odometry(origin=origin(0)), transport=DIRECT.id))

    watch.passed_over("AGI", Odometry, 3)
    watch.arrived(received(odometry(origin=origin(5)), transport=DIRECT.id))

    (stream,) = (one for one in watch.streams if one.data == "odometry")
    assert (stream.up.passed, stream.up.missing, stream.up.skipped) == (5, 1, 3)


def test_disorder_is_named_at_its_hop() -> None:
    chain = Chain()
    chain.run(10.0)

    chain.agent = jittered(0.0, 0.4)
    chain.run(3.0)

    assert "latency.reordered.fiware" in chain.said()
