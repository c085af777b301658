"""Whatever a network does to the messages of one boot, the newest one wins."""

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.observations import Odometry, Origin
from iveg.domain.stream_order import StreamOrder
from iveg.domain.world import World
from tests.builders import odometry, origin, received

seqs = st.lists(st.integers(0, 500), min_size=1, max_size=200)
stamps = st.floats(-2e9, 2e9)


@given(seqs, st.data())
def test_any_order_of_the_same_messages_gives_the_same_newest_state(
    sent: list[int], data: st.DataObject
) -> None:
    arrived = data.draw(st.permutations(sent))
    world = World(["AGI"])
    for seq in arrived:
        world.apply(received(odometry(x=float(seq), origin=origin(seq))))

    newest = world.robot("AGI").odometry
    assert isinstance(newest, Odometry)
    assert newest.pose.x == max(sent)


@given(seqs)
def test_each_message_is_new_late_or_a_duplicate_and_counted_as_one(
    arrived: list[int],
) -> None:
    world = World(["AGI"])
    verdicts = [world.apply(received(odometry(origin=origin(seq)))) for seq in arrived]

    counted = {f"Odometry.{name}": n for name, n in Counter(verdicts).items()}
    assert world.counters == counted


@given(st.lists(st.tuples(st.integers(0, 50), stamps), min_size=1, max_size=60))
def test_no_stamp_ever_orders_anything(arrived: list[tuple[int, float]]) -> None:
    stamped, silent = StreamOrder(), StreamOrder()
    for seq, stamp_s in arrived:
        plain = origin(seq)
        off = Origin(plain.boot, seq, "whenever", stamp_s)
        assert stamped.judge(off, 0.0) == silent.judge(Origin(plain.boot, seq), 0.0)
