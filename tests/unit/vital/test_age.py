"""Proven and estimated ages, from what arrives to what is said and done."""

from collections import Counter
from dataclasses import replace

from iveg.domain.observations import (
    DetectionFrame,
    FeedbackRef,
    Hold,
    Origin,
    SafetyReport,
)
from iveg.domain.transports import FIWARE
from tests.builders import detection, detection_frame, odometry, origin, safety_report
from tests.unit.vital.desk import Desk


class Robot:
    """AGI as it is built today: it echoes, and tells its own monotonic seconds."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.speed = 0.5
        self._seqs: Counter[str] = Counter()

    def _origin(self, topic: str) -> Origin:
        self._seqs[topic] += 1
        now = self.desk.clock.now
        told = self.desk.fleet.told[-1].origin if self.desk.fleet.told else Origin()
        heard = FeedbackRef(told.boot or "", told.seq or 0)
        said = origin(self._seqs[topic], after=now)
        return replace(said, mono=5.0 + now, acknowledgements=True, heard=heard)

    def live(self, *, orion_alone: bool = False) -> None:
        """One moment: odometry through Orion, a report straight from MQTT."""
        said = odometry(linear=self.speed, origin=self._origin("odom"))
        self.desk.hear(said, FIWARE.id)
        report = self.report()
        if not orion_alone:
            self.desk.hear(report)

    def report(self) -> SafetyReport:
        """It is held as iVeg wants."""
        hold_id = self.desk.commander.machine("AGI").hold_id
        holds = () if hold_id is None else (Hold(hold_id, "iveg", "remote"),)
        return safety_report(
            "AGI", *holds, linear=self.speed, origin=self._origin("safety")
        )

    async def live_for(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            self.live()
            await self.desk.wait(0.1)

    @property
    def state(self) -> str:
        return self.desk.commander.machine("AGI").state


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

    assert robot.desk.sentences().count("log.stop.moved") == 1


async def test_a_standstill_is_told_only_of_reports_that_are_young() -> None:
    desk = Desk(("AGI",))
    robot = Robot(desk)
    robot.speed = 0.0
    await desk.commander.stop(["AGI"], "ana", desk.clock())
    late: list[tuple[float, SafetyReport]] = []
    for _ in range(60):
        late.append((desk.clock.now + 2.0, robot.report()))
        while late and late[0][0] <= desk.clock.now:
            desk.hear(late.pop(0)[1])
        await desk.wait(0.1)

    assert robot.state not in ("STANDING", "STALE")


async def test_a_standstill_that_is_not_proven_any_more_is_stale() -> None:
    robot = await standing()

    late = robot.report()
    await robot.desk.wait(1.4)
    robot.desk.hear(late)
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
    moment = replace(
        origin(1, boot="earlier", after=-200.0),
        mono=5.1,
        acknowledgements=True,
        heard=FeedbackRef("iveg before", 10**6),
    )
    desk.hear(safety_report("AGI", hold, speed_factor=0.0, origin=moment))

    assert desk.commander.machine("AGI").state == "DELIVERED"
