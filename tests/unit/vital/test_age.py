"""Proven and estimated ages, from what arrives to what is said and done."""

from collections import Counter
from dataclasses import replace

import pytest

from iveg.domain.observations import (
    DetectionFrame,
    FeedbackRef,
    Hold,
    Odometry,
    Origin,
    SafetyReport,
)
from iveg.domain.transports import FIWARE
from tests.builders import detection, detection_frame, odometry, origin, safety_report
from tests.unit.vital.desk import Desk, conditions_of

HOUR_S = 3600.0


class Robot:
    """AGI as it is built today: it echoes, and tells its own monotonic seconds.

    Attributes:
        clock_off: Its wall clock is this far ahead (s).
        frozen: Orion keeps odometry to itself.
    """

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.speed = 0.5
        self.clock_off = 0.0
        self.frozen = False
        self._kept: list[Odometry] = []
        self._seqs: Counter[str] = Counter()

    def _origin(self, topic: str) -> Origin:
        self._seqs[topic] += 1
        now = self.desk.clock.now
        told = self.desk.fleet.told[-1].origin if self.desk.fleet.told else Origin()
        heard = FeedbackRef(told.boot or "", told.seq or 0)
        said = origin(self._seqs[topic], after=now + self.clock_off)
        return replace(said, mono=5.0 + now, acknowledgements=True, heard=heard)

    def live(self, *, orion_alone: bool = False) -> None:
        """One moment: odometry through Orion, a report straight from MQTT."""
        self._kept.append(odometry(linear=self.speed, origin=self._origin("odom")))
        if not self.frozen:
            self.thaw()
        hold_id = self.desk.commander.machine("AGI").hold_id
        holds = () if hold_id is None else (Hold(hold_id, "iveg", "remote"),)
        report = safety_report(
            "AGI", *holds, linear=self.speed, origin=self._origin("safety")
        )
        if not orion_alone:
            self.desk.hear(report)

    def thaw(self) -> None:
        """What Orion has kept arrives."""
        for one in self._kept:
            self.desk.hear(one, FIWARE.id)
        self._kept.clear()

    async def live_for(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            self.live()
            await self.desk.wait(0.1)

    @property
    def state(self) -> str:
        return self.desk.commander.machine("AGI").state

    def reasons(self) -> list[str]:
        """Why it was stopped anew."""
        return [one for one in self.desk.sentences() if one == "log.stop.moved"]


async def standing() -> Robot:
    """A robot that drove, was stopped, and stands."""
    desk = Desk(("AGI",))
    robot = Robot(desk)
    await robot.live_for(1.0)
    await desk.commander.stop(["AGI"], "ana", desk.clock())
    await robot.live_for(0.5)
    robot.speed = 0.0
    await robot.live_for(1.5)
    assert robot.state == "STANDING"
    return robot


async def test_odometry_that_orion_kept_for_ten_seconds_stops_nobody_again() -> None:
    desk = Desk(("AGI",))
    robot = Robot(desk)
    await robot.live_for(1.0)
    robot.frozen = True
    await desk.commander.stop(["AGI"], "ana", desk.clock())
    await robot.live_for(1.0)
    robot.speed = 0.0
    await robot.live_for(9.0)
    stood = robot.state

    robot.thaw()
    robot.frozen = False
    await robot.live_for(2.0)

    assert (stood, robot.state, robot.reasons()) == ("STANDING", "STANDING", [])


@pytest.mark.parametrize("step_s", [HOUR_S, -HOUR_S])
async def test_motion_during_a_hold_ends_it_whatever_the_robots_clock_says(
    step_s: float,
) -> None:
    robot = await standing()
    robot.clock_off = step_s
    await robot.live_for(1.0)
    stood = robot.state

    robot.speed = 0.3
    await robot.live_for(1.0)

    assert stood == "STANDING"
    assert robot.state != "STANDING"
    assert robot.reasons() == ["log.stop.moved"]


async def test_motion_is_seen_in_odometry_though_reports_say_that_it_stands() -> None:
    robot = await standing()
    for _ in range(5):
        robot.speed = 0.3
        robot.live(orion_alone=True)
        robot.speed = 0.0
        robot.live()
        await robot.desk.wait(0.1)
    assert robot.state == "STANDING", "each moving sample was followed by one at rest"

    robot.speed = 0.3
    for _ in range(5):
        robot.live(orion_alone=True)
        await robot.desk.wait(0.1)

    assert robot.reasons() == ["log.stop.moved"]


async def test_a_standstill_is_told_only_of_reports_that_are_young() -> None:
    desk = Desk(("AGI",))
    robot = Robot(desk)
    robot.speed = 0.0
    await desk.commander.stop(["AGI"], "ana", desk.clock())
    late: list[tuple[float, SafetyReport]] = []
    for _ in range(60):
        late.append((desk.clock.now + 2.0, robot_report(robot)))
        await deliver(desk, late)

    assert robot.state not in ("STANDING", "STALE")


def robot_report(robot: Robot) -> SafetyReport:
    hold_id = robot.desk.commander.machine("AGI").hold_id or ""
    hold = Hold(hold_id, "iveg", "remote")
    return safety_report("AGI", hold, origin=robot._origin("safety"))


async def deliver(desk: Desk, late: list[tuple[float, SafetyReport]]) -> None:
    while late and late[0][0] <= desk.clock.now:
        desk.hear(late.pop(0)[1])
    await desk.wait(0.1)


async def test_a_standstill_that_is_not_proven_any_more_is_stale() -> None:
    robot = await standing()

    late = [robot_report(robot) for _ in range(20)]
    await robot.desk.wait(1.4)
    robot.desk.hear(late[0])
    await robot.desk.wait(0.2)

    assert robot.state == "STALE"


async def test_each_robot_whose_age_is_estimated_is_a_notice() -> None:
    desk = Desk()
    for _ in range(60):
        desk.drive("AGI", linear=0.0)
        desk.drive("AGII", 50.0, linear=0.0)
        await desk.wait(0.1)

    told = [one.condition for one in desk.evaluator.alerts.waiting]
    assert [(one.priority, one.key, one.subject) for one in told] == [
        ("P3", "alert.age_estimated", "AGI"),
        ("P3", "alert.age_estimated", "AGII"),
    ]


async def test_a_robot_that_stands_and_whose_odometry_is_late_did_not_move() -> None:
    robot = await standing()
    robot.frozen = True
    await robot.live_for(0.5)
    robot.desk.hear(odometry(linear=0.0, origin=robot._origin("odom")), FIWARE.id)
    robot.desk.world.robot("AGI").odometry = odometry(linear=0.5)

    await robot.live_for(4.0)

    assert "alert.robot_lost" in conditions_of(robot.desk)
    assert "alert.moving_robot_lost" not in conditions_of(robot.desk)


async def test_a_slow_agent_beside_fast_direct_messages_warns_of_no_clock() -> None:
    desk = Desk(("AGI",))
    late: list[tuple[float, Odometry]] = []
    for number in range(600):
        one = odometry(origin=origin(number + 1, after=desk.clock.now))
        late.append((desk.clock.now + 0.05 * number, one))
        desk.hear(safety_report(origin=one.origin))
        while late and late[0][0] <= desk.clock.now:
            desk.hear(late.pop(0)[1], FIWARE.id)
        await desk.wait(0.05)

    raised = [one.condition.key for one in desk.evaluator.alerts.waiting]
    assert "alert.clock_offset" not in raised
    assert desk.world.robot("AGI").clock.offset_s(desk.clock()) == pytest.approx(
        0.0, abs=1e-6
    )


async def test_a_link_that_nothing_proves_is_told_as_lost_and_said_why() -> None:
    desk = Desk(("AGI",))
    for number in range(40):
        silent = replace(
            origin(number + 1, after=desk.clock.now), acknowledgements=True
        )
        desk.hear(odometry(origin=silent))
        await desk.wait(0.1)

    assert desk.world.robot("AGI").link(desk.clock()) == "LOST"
    told = [one for one in desk.sentences() if one.startswith("log.link")]
    assert told == ["log.link.unproven"]


async def test_what_the_agent_brings_late_shows_no_ghosts() -> None:
    late_s, desk = 8.0, Desk(("AGI",))
    robot = Robot(desk)
    late: list[tuple[float, DetectionFrame]] = []
    for number in range(round(10 * late_s) + 100):
        robot.live()
        # Somebody walks by at 1.5 m/s, and is seen thirty times in three seconds.
        walker = detection("farmer", 5.0 + 0.15 * number, 2.0)
        seen = (walker,) if number < 30 else ()
        look = detection_frame("AGI", *seen, origin=robot._origin("look"))
        desk.hear(look)
        late.append((desk.clock.now + late_s, look))
        while late and late[0][0] <= desk.clock.now:
            desk.hear(late.pop(0)[1], FIWARE.id)
        await desk.wait(0.1)

    assert len(desk.evaluator.people.known) == 1


def kept_by_orion(seq: int, *holds: Hold, boot: str = "earlier") -> SafetyReport:
    """A report that Orion kept for 200 s: it echoes feedback of another iVeg."""
    moment = replace(
        origin(seq, boot=boot, after=-200.0),
        mono=5.0 + 0.1 * seq,
        acknowledgements=True,
        heard=FeedbackRef("iveg before", 10**6),
    )
    return safety_report("AGI", *holds, speed_factor=0.0, origin=moment)


async def test_a_report_of_no_known_age_confirms_no_release() -> None:
    robot = await standing()
    machine = robot.desk.commander.machine("AGI")
    held = machine.hold_id or ""
    await robot.desk.commander.release("AGI", [held], "ana", robot.desk.clock())
    asked = robot.state
    moment = origin(1, boot="earlier", after=-200.0)
    said = safety_report("AGI", released=(held,), origin=moment)

    robot.desk.hear(said, FIWARE.id)

    assert (asked, robot.state) == ("RELEASING", "RELEASING")


async def test_a_report_of_no_known_age_that_holds_our_hold_has_received_it() -> None:
    desk = Desk()
    await desk.commander.stop(["AGI"], "ana", desk.clock())
    hold = Hold(desk.commander.machine("AGI").hold_id or "", "iveg", "remote")
    desk.hear(kept_by_orion(1, hold))

    assert desk.commander.machine("AGI").state == "DELIVERED"
