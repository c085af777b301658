"""The decision record, link by link."""

from dataclasses import replace

import pytest

from iveg.domain.alerts import of_robot
from iveg.domain.decisions import Decisions, SlowdownDecision
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.observations import FeedbackRef
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.zones import Zone, ZoneEntry
from iveg.domain.tracking.tracker import Sighting
from iveg.domain.transports import DIRECT
from iveg.domain.world import World
from tests.builders import START, at, odometry, origin, received, safety_report

LOOK = Sighting("AGI", 1.0, 0.0, 0.9, START, "farmer", 0.94)


def entry(sighting: Sighting | None = LOOK) -> ZoneEntry:
    zone = Zone("person", "P1", "AGI", 1.0, 0.0, 2.0, sighting)
    if sighting is None:
        zone = Zone("robot", "AGI", "AGI", 1.0, 0.0, 2.0)
    return ZoneEntry(
        "d-1",
        "AGII",
        zone,
        entered=START,
        entered_m=1.43,
        speed_before=0.8,
        in_sight=False,
        distance_m=1.43,
    )


def begun() -> Decisions:
    book = Decisions()
    book.begin(entry(), DetectionRule())
    return book


def obeyed(after: float = 0.2) -> SlowdownDecision:
    book = begun()
    book.published(at(0.01))
    book.reported(safety_report("AGII", speed_factor=0.5, reason="person"), at(after))
    (one,) = book.moved("AGII", 0.4, at(after), is_slow=True)
    return one


def verdicts(one: SlowdownDecision) -> dict[str, str]:
    return {link.name: link.verdict for link in one.links()}


def test_every_link_has_its_time_and_value() -> None:
    links = {link.name: link for link in obeyed().links()}

    assert links["detection"].value == "farmer"
    assert links["filter"].value == 0.94
    assert links["geometry"].value == 1.43
    assert links["rule"].value == "fleet-alert 1"
    assert links["applied"].value == 0.5
    assert links["observed"].value == 0.4
    assert links["observed"].at == at(0.2).wall


def test_what_did_not_come_in_time_or_until_the_end_is_missing() -> None:
    book = begun()

    assert book.reported(safety_report("AGII", speed_factor=1.0), at(0.1)) == []
    assert book.age(lambda _: 1.9) == []
    (aged,) = book.age(lambda _: 2.0)
    assert aged.waited_out
    assert book.age(lambda _: 9.0) == []
    assert verdicts(aged)["applied"] == "missing"
    (ended,) = begun().end("d-1", at(0.5))
    assert verdicts(ended)["applied"] == "missing"


@pytest.mark.parametrize(("after", "verdict"), [(1.0, "ok"), (1.01, "late")])
def test_a_link_after_a_second_is_late(after: float, verdict: str) -> None:
    assert verdicts(obeyed(after))["applied"] == verdict


def test_a_peers_own_odometry_needs_no_detection() -> None:
    found = verdicts(Decisions().begin(entry(sighting=None), DetectionRule()))

    assert (found["detection"], found["filter"]) == ("n/a", "n/a")


# --- robots -----------------------------------------------------------------------


def robot_keys(robot: RobotState, after: float) -> list[tuple[str, str]]:
    return [(wrong.priority, wrong.key) for wrong in of_robot(robot, at(after))]


@pytest.mark.parametrize(
    ("linear", "expected"),
    [(0.5, ("P1", "alert.moving_robot_lost")), (0.0, ("P2", "alert.robot_lost"))],
)
def test_a_lost_robot_is_graver_when_it_was_moving(
    linear: float, expected: tuple[str, str]
) -> None:
    world = World(["AGI"])
    world.apply(received(odometry(linear=linear)))

    assert robot_keys(world.robot("AGI"), 2.9) == []
    assert robot_keys(world.robot("AGI"), 3.1) == [expected]


def test_a_robot_whose_pose_went_on_was_moving_whatever_its_twist_said() -> None:
    world = World(["AGI"])
    for number in range(11):
        name, moment = origin(number, after=number / 10), number / 10
        said = odometry(x=0.03 * number, linear=0.0, origin=name)
        world.apply(received(said, after=moment))

    assert robot_keys(world.robot("AGI"), 4.2) == [("P1", "alert.moving_robot_lost")]


@pytest.mark.parametrize(("composed", "told"), [(-0.1, True), (-12.0, False)])
def test_the_clock_of_a_robot_that_echoes_is_not_blamed_for_a_late_transport(
    composed: float, told: bool
) -> None:
    world = World(["AGI"])
    world.ledger.composed("iveg", 1, 1, at(composed).mono)
    heard = FeedbackRef("iveg", 1)
    late = replace(origin(1, after=-10.0), acknowledgements=True, heard=heard)
    world.apply(received(odometry(origin=late), transport=DIRECT.id))

    found = robot_keys(world.robot("AGI"), 0.1)

    assert (("P3", "alert.clock_offset") in found) is told


# --- the book ---------------------------------------------------------------------


def test_what_a_robot_does_changes_its_own_open_decisions_once() -> None:
    book = begun()

    assert book.moved("AGI", 0.1, at(1), is_slow=True) == []
    assert book.moved("AGII", 0.9, at(1), is_slow=False) == []
    (changed,) = book.moved("AGII", 0.1, at(1), is_slow=True)
    assert book.moved("AGII", 0.1, at(2), is_slow=True) == []
    assert book.get("d-1") is changed


def test_old_ended_decisions_make_room_and_open_ones_never_do() -> None:
    book = Decisions(keep=2)
    opened = book.begin(entry()._replace(decision_id="open"), DetectionRule())
    for number in range(5):
        named = entry()._replace(decision_id=f"ended-{number}")
        book.begin(named, DetectionRule())
        book.end(named.decision_id, at(number))

    assert book.get("open") is opened
    assert book.get("ended-0") is None
    assert book.get("ended-4") is not None


def test_what_was_open_when_iveg_went_away_is_unknown_and_says_when() -> None:
    book = begun()
    book.published(at(0.01))
    (broken,) = book.break_off(at(0.5))

    found = verdicts(broken)
    assert found["feedback"] == "ok"
    assert broken.links()[-1].at == at(0.5).wall
    assert (found["applied"], found["observed"]) == ("unknown", "unknown")
    assert found["interrupted"] == "unknown"
