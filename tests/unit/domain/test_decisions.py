"""The decision record, link by link."""

from dataclasses import replace

import pytest

from iveg.domain.alerts.conditions import of_decision, of_robot
from iveg.domain.decisions import Decisions, SlowdownDecision
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.observations import FeedbackRef, SafetyReport
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.crossings import Crossing
from iveg.domain.rule.zones import Zone
from iveg.domain.tracking.person import Sighting
from iveg.domain.transports import DIRECT
from iveg.domain.world import World
from tests.builders import (
    START,
    at,
    odometry,
    origin,
    received,
    safety_report,
)

LOOK = Sighting("AGI", 1.0, 0.0, 0.9, START, "farmer", 0.94)


def crossing(
    *,
    speed: float = 0.8,
    already_slow: bool = False,
    speeding_up: bool = False,
    sighting: Sighting | None = LOOK,
) -> Crossing:
    zone = Zone("person", "P1", "AGI", 1.0, 0.0, 2.0, sighting)
    if sighting is None:
        zone = Zone("robot", "AGI", "AGI", 1.0, 0.0, 2.0)
    return Crossing(
        "d-1",
        "AGII",
        zone,
        entered=START,
        entered_m=1.43,
        speed_before=speed,
        in_sight=False,
        distance_m=1.43,
        already_slow=already_slow,
        speeding_up=speeding_up,
    )


def decision(**parts: object) -> SlowdownDecision:
    return SlowdownDecision(crossing(**parts), DetectionRule())  # type: ignore[arg-type]


def slow() -> SafetyReport:
    return safety_report("AGII", speed_factor=0.5, reason="person")


def verdicts(one: SlowdownDecision, after: float) -> dict[str, str]:
    """Of a robot that has been heard all the time (s)."""
    return {link.name: link.verdict for link in one.aged(after).links()}


def obeyed(one: SlowdownDecision, after: float = 0.2) -> SlowdownDecision:
    done = one.published(at(0.01)).reported(slow(), at(after))
    return done.moved(0.4, at(after))


def test_a_decision_that_was_obeyed_has_every_link() -> None:
    assert verdicts(obeyed(decision()), 0.3) == {
        "detection": "ok",
        "filter": "ok",
        "geometry": "ok",
        "rule": "ok",
        "feedback": "ok",
        "applied": "ok",
        "observed": "ok",
    }


def test_every_link_has_its_time_and_value() -> None:
    links = {link.name: link for link in obeyed(decision()).links()}

    assert links["detection"].value == "farmer"
    assert links["filter"].value == 0.94
    assert links["geometry"].value == 1.43
    assert links["rule"].value == "fleet-alert 1"
    assert links["applied"].value == 0.5
    assert links["observed"].value == 0.4
    assert links["observed"].at == at(0.2).wall


def test_links_that_have_not_come_are_open_at_first() -> None:
    found = verdicts(decision(), 0.5)

    assert (found["feedback"], found["applied"], found["observed"]) == ("open",) * 3


def test_links_that_have_not_come_after_two_seconds_are_missing() -> None:
    found = verdicts(decision(), 2.0)

    assert (found["feedback"], found["applied"], found["observed"]) == ("missing",) * 3


def test_links_that_had_not_come_at_the_end_are_missing() -> None:
    assert verdicts(decision().closed(at(0.5)), 0.6)["applied"] == "missing"


@pytest.mark.parametrize(("after", "verdict"), [(1.0, "ok"), (1.01, "late")])
def test_a_link_after_a_second_is_late(after: float, verdict: str) -> None:
    assert verdicts(obeyed(decision(), after), 3.0)["applied"] == verdict


def test_a_peers_own_odometry_needs_no_detection() -> None:
    found = verdicts(decision(sighting=None), 0.0)

    assert (found["detection"], found["filter"]) == ("n/a", "n/a")


@pytest.mark.parametrize(
    "parts",
    [
        {"speed": 0.2},
        {"speed": 0.0},
        {"already_slow": True},
        {"speeding_up": True},
    ],
)
def test_a_robot_that_was_slow_or_speeding_up_has_nothing_to_show(
    parts: dict[str, object],
) -> None:
    assert verdicts(decision(**parts), 3.0)["observed"] == "n/a"


@pytest.mark.parametrize(
    ("speed", "seen"), [(0.44, True), (-0.44, True), (0.45, False)]
)
def test_the_slow_down_is_seen_at_55_percent(speed: float, seen: bool) -> None:
    assert (decision().moved(speed, at(0.5)).observed is not None) is seen


def test_a_report_at_full_speed_is_no_obedience() -> None:
    faster = safety_report("AGII", speed_factor=1.0)

    assert decision().reported(faster, at(0.1)).applied is None


def test_only_the_first_time_of_a_link_counts() -> None:
    first = obeyed(decision())

    again = first.published(at(1)).reported(slow(), at(1)).moved(0.1, at(1))

    assert again is first


def test_what_is_reported_after_the_end_is_not_for_this_decision() -> None:
    assert decision().closed(at(0.5)).reported(slow(), at(0.6)).applied is None


# --- overdue ----------------------------------------------------------------------


def keys(one: SlowdownDecision, after: float) -> list[tuple[str, str]]:
    return [(wrong.priority, wrong.key) for wrong in of_decision(one.aged(after))]


def test_a_slow_down_that_is_obeyed_is_no_alert() -> None:
    assert keys(obeyed(decision()), 5.0) == []


@pytest.mark.parametrize(("after", "priorities"), [(1.99, []), (2.0, ["P1"])])
def test_a_robot_that_does_not_slow_down_in_two_seconds_is_grave(
    after: float, priorities: list[str]
) -> None:
    assert [priority for priority, _ in keys(decision(), after)] == priorities


def test_a_robot_that_says_so_and_drives_on_is_grave() -> None:
    said = decision().published(at(0.1)).reported(slow(), at(0.1))

    assert keys(said, 2.5) == [("P1", "alert.person_not_slowing")]


def test_a_robot_that_was_slow_already_only_has_to_say_so() -> None:
    said = decision(already_slow=True).reported(slow(), at(0.1))

    assert keys(said, 5.0) == []


def test_an_ended_decision_is_never_overdue() -> None:
    assert not decision().closed(at(1.0)).aged(60.0).is_overdue


def test_a_peer_that_slows_is_no_notice_and_one_that_does_not_is_grave() -> None:
    peer = decision(sighting=None)

    assert keys(peer, 0.5) == []
    assert keys(peer, 2.5) == [("P1", "alert.no_slow_down")]


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


@pytest.mark.parametrize(("offset", "told"), [(0.24, False), (0.3, True), (-0.3, True)])
def test_a_clock_a_quarter_second_off_is_told(offset: float, told: bool) -> None:
    world = World(["AGI"])
    world.apply(received(odometry(origin=origin(1, after=offset)), transport=DIRECT.id))

    found = robot_keys(world.robot("AGI"), 0.1)

    assert (("P3", "alert.clock_offset") in found) is told


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


def test_decisions_are_found_by_name_and_while_open() -> None:
    book = Decisions()
    begun = book.begin(crossing(), DetectionRule())

    assert book.get("d-1") is begun
    assert book.get("d-2") is None
    assert book.open == [begun]
    book.end("d-1", at(1))
    assert book.open == []


def test_what_a_robot_does_changes_its_own_open_decisions_once() -> None:
    book = Decisions()
    book.begin(crossing(), DetectionRule())
    slowed = odometry("AGII", linear=0.1, origin=origin(1))

    assert book.moved(odometry("AGI", linear=0.1, origin=origin(1)), at(1)) == []
    (changed,) = book.moved(slowed, at(1))
    assert book.moved(slowed, at(2)) == []
    assert book.get("d-1") is changed


def test_old_ended_decisions_make_room_and_open_ones_never_do() -> None:
    book = Decisions(keep=2)
    opened = book.begin(replace(crossing(), decision_id="open"), DetectionRule())
    for number in range(5):
        named = replace(crossing(), decision_id=f"ended-{number}")
        book.begin(named, DetectionRule())
        book.end(named.decision_id, at(number))

    assert book.get("open") is opened
    assert book.get("ended-0") is None
    assert book.get("ended-4") is not None


def test_what_did_not_come_in_time_is_missing_from_then_on() -> None:
    one = decision()

    assert one.aged(1.9) is one
    aged = one.aged(2.0)
    assert aged.waited_out
    assert aged.aged(9.0) is aged
    assert verdicts(aged, 2.0)["applied"] == "missing"


def test_what_was_open_when_iveg_went_away_is_unknown_and_says_when() -> None:
    broken = decision().published(at(0.01)).broken_off(at(0.5))

    assert verdicts(broken, 99.0)["feedback"] == "ok"
    assert broken.links()[-1].at == at(0.5).wall
    assert {name: verdicts(broken, 0.5)[name] for name in ("applied", "observed")} == {
        "applied": "unknown",
        "observed": "unknown",
    }
    assert verdicts(broken, 0.5)["interrupted"] == "unknown"


def test_what_was_missing_when_iveg_went_away_is_missing() -> None:
    broken = decision().aged(3.0).broken_off(at(5.0))

    assert verdicts(broken, 5.0)["applied"] == "missing"
