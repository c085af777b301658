"""Whatever comes late changes the history alone."""

from typing import Any

import orjson
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iveg.adapters.backfill import BackfillReader
from iveg.domain.observations import Origin, Received
from iveg.domain.records import (
    AlertRecord,
    DecisionRecord,
    DetectionRecord,
    OdometryRecord,
)
from iveg.domain.transports import DIRECT
from iveg.ngsi import codec
from tests.builders import detection, detection_frame, odometry, safety_report
from tests.unit.pipeline.desk import Desk

TOPIC = "/AGI/iveg/backfill"
SENT = 100.0
"""Of the robot's clock, when the batch is sent, 16 s after the start."""


def kept(kind: str, seq: int, mono: float, value: float, boot: str) -> Any:
    """One kept message as its payload says it."""
    own = Origin(boot, seq, None, mono=mono)
    match kind:
        case "pose":
            return orjson.loads(
                codec.write_odometry(odometry(x=value, linear=0.1, origin=own))
            )
        case "picture":
            seen = detection(x=value)
            return orjson.loads(
                codec.write_detections(detection_frame("AGI", seen, origin=own))
            )
    report = safety_report(speed_factor=0.5, reason="person", origin=own)
    return orjson.loads(codec.write_safety(report))


def batch(messages: list[Any], boot: str = "b", mono: float = SENT) -> bytes:
    head = {"robot_id": "AGI", "boot": boot, "mono": mono}
    return orjson.dumps({**head, "messages": messages})


MESSAGES = st.builds(
    kept,
    st.sampled_from(["pose", "picture", "report"]),
    st.integers(0, 60),
    st.floats(0.0, 1e9) | st.floats(84.0, 100.0),
    st.floats(-90.0, 90.0),
    st.sampled_from(["b", "boot-a", "c"]),
)
JSON = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(max_size=9),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=9), inner)
    ),
    max_leaves=6,
)
LATE = (
    st.builds(batch, st.lists(MESSAGES, max_size=24), st.sampled_from(["b", "c"]))
    | st.binary(max_size=40)
    | st.builds(orjson.dumps, JSON)
    | st.builds(lambda one: batch([one]), JSON)
)


class Played:
    """A run with a gap of AGI from 5 s to 15 s, and what comes late at its end."""

    def __init__(self, *late: bytes) -> None:
        self.desk = desk = Desk()
        parts = desk.parts
        reader = BackfillReader(
            ("AGI", "AGII"),
            desk.clock,
            parts.backfill.has_room,
            parts.backfill.record,
            parts.ingest.reject,
        )
        read = reader.beside(lambda *_: None)
        for tick in range(72):
            desk.clock.now = tick / 4
            if not 5.0 < desk.clock.now < 15.0:
                self._live("AGI")
            self._live("AGII")
            if tick == 64:
                for one in late:
                    read(TOPIC, one)
            desk.loop.step([], desk.clock())
        self.told = self._state()

    def _live(self, robot_id: str) -> None:
        desk = self.desk
        for one in (
            odometry(robot_id, origin=desk.next_origin()),
            detection_frame(robot_id, detection(x=1.0), origin=desk.next_origin()),
            safety_report(robot_id, origin=desk.next_origin()),
        ):
            desk.ingest.enqueue(received(desk, one))
        desk.loop.step(desk.ingest.drain(), desk.clock())

    def _state(self) -> object:
        desk = self.desk
        now = desk.clock()
        return (
            [
                (one.robot_id, one.alerts, one.speed_limits, one.pose, one.seen)
                for one in desk.fleet.told
            ],
            [str(one.condition) for one in desk.evaluator.alerts.waiting],
            [desk.commander.machine(one).state for one in ("AGI", "AGII")],
            [(one.link(now), one.odometry) for one in desk.world.live_robots()],
            dict(desk.world.counters),
            [one for one in desk.records(DecisionRecord) if one.kind != "late"],
            desk.records(AlertRecord),
        )

    def rows(self, kind: type[Any]) -> list[Any]:
        return desk_rows(self.desk, kind)


def desk_rows(desk: Desk, kind: type[Any]) -> list[Any]:
    return [one for one in desk.records(kind) if one.late]


def received(desk: Desk, one: Any) -> Any:
    return Received(one, desk.clock(), DIRECT.id)


_PLAIN = Played()


@settings(max_examples=10, deadline=None)
@given(st.lists(LATE, max_size=4))
def test_nothing_that_is_decided_differs_for_what_comes_late(late: list[bytes]) -> None:
    assert Played(*late).told == _PLAIN.told


def test_a_gap_is_filled_in_its_place_and_once() -> None:
    messages = [
        kept("report", 1, 90.0, 0.0, "b"),
        kept("pose", 2, 90.0, 7.0, "b"),
        kept("picture", 3, 90.1, 8.0, "b"),
        kept("pose", 4, 86.0, 9.0, "b"),
        kept("pose", 5, 99.5, 9.0, "b"),
    ]
    whole = batch(messages)

    run = Played(whole, whole)

    (pose,) = run.rows(OdometryRecord)
    assert (pose.x, pose.applied_factor, pose.link) == (7.0, 0.5, "LOST")
    assert pose.at == run.desk.clock().wall - 17.75 + 6.0
    (seen,) = run.rows(DetectionRecord)
    assert (seen.x, seen.class_, seen.person_id) == (8.0, "person", None)
    counters = run.desk.parts.backfill.counters
    assert counters["backfill.taken"] == 3
    assert counters["backfill.heard_live"] == 4
    assert counters["backfill.duplicate"] == 3


def test_what_nobody_could_decide_in_a_gap_is_decided_afterwards_and_once() -> None:
    messages = [kept("report", 1, 90.0, 0.0, "b"), kept("pose", 2, 90.0, 7.0, "b")]
    # Somebody 1, 1.5, 5 and 1 m ahead, the last one after 4 s.
    for seq, (at, ahead) in enumerate(
        ((90.1, 1.0), (91.0, 1.5), (92.0, 5.0), (95.0, 1.0)), 3
    ):
        pose = kept("pose", 2 * seq, at - 0.1, 7.0, "b")
        messages += [pose, kept("picture", 2 * seq + 1, at, 7.0 + ahead, "b")]
    whole = batch(messages)

    run = Played(whole, whole)

    rows = [one for one in run.desk.records(DecisionRecord) if one.kind == "late"]
    first, second = {one.decision_id: one for one in rows}.values()
    began = run.desk.clock().wall - 17.75 + 6.1
    assert (first.robot_id, first.class_, first.speed_factor) == ("AGI", "person", 0.5)
    assert (first.started_at, first.ended_at) == pytest.approx((began, began + 0.9))
    assert (second.started_at, second.ended_at) == pytest.approx((began + 4.9,) * 2)
    assert first.distance_m == pytest.approx(1.0)
    verdicts = {one["link"]: one["verdict"] for one in first.links}
    assert verdicts == {
        **dict.fromkeys(("detection", "filter", "geometry", "rule", "applied"), "ok"),
        **dict.fromkeys(("feedback", "observed"), "n/a"),
    }
    assert run.told == _PLAIN.told


def test_bad_batches_are_counted_and_a_flood_ends() -> None:
    hostile = [
        b"{",
        batch([], mono=-1.0),
        b"[" * 20_000,
        batch([{}] * 21),
        orjson.dumps({"robot_id": "AGII", "boot": "b", "mono": 1, "messages": []}),
        batch([kept("pose", 1, 101.0, 0.0, "b")]),
        batch([kept("pose", 2, 100.0, 0.0, "b")], mono=3e9 / 4),
        batch([kept("pose", 3, 90.0, 0.0, "other")]),
    ]

    counters = Played(*hostile, *[batch([])] * 50).desk.ingest.counters

    told = {one.removeprefix("rejected.") for one in counters if "rejected" in one}
    assert told >= {
        *("not_json", "too_large", "not_a_backfill", "another_robot"),
        *("late_from_the_future", "late_too_old", "late_without_origin"),
    }
    assert counters["rejected.late_flood"] == 48
