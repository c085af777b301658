"""What the past of a robot says moves nothing of a STOP, however FIWARE mixes it in.

On the virtual clock: iVeg has just started, and FIWARE alone connects a robot that
reboots now and then and holds what it was stopped with over each reboot.  Its reports
and odometry take their own time, up to minutes, and overtake one another; among them is
what an earlier boot said to an earlier iVeg.
"""

import heapq
import itertools
from dataclasses import dataclass, field, replace
from random import Random

import pytest

from iveg.domain.observations import FeedbackRef, Hold, Odometry, Origin, SafetyReport
from iveg.domain.transports import FIWARE
from tests.builders import odometry, origin, safety_report
from tests.fakes.echo import Echo
from tests.unit.vital.desk import Desk

STEP_S = 0.1
LATE_S = (0.0, 0.3, 0.3, 5.0, 60.0, 200.0)
FORGOTTEN = Hold("01BEFORE", "iveg", "remote")
LIVES = 30


@dataclass
class Life:
    """One robot behind FIWARE, and an iVeg that has just started.

    Attributes:
        late_s: So late is what the robot says now, at most; ``down_s`` what it hears.
        holds: What holds the robot.
    """

    rnd: Random
    late_s: float = 0.0
    down_s: float = 0.0
    boots: int = 0
    holds: tuple[Hold, ...] = ()
    way: list[tuple[float, int, SafetyReport | Odometry]] = field(default_factory=list)
    heard: list[tuple[float, Origin]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.desk = Desk(("AGI",), direct=False)
        self.number = itertools.count()
        self.reboot()
        self._say_the_past()

    def reboot(self) -> None:
        self.boots += 1
        self.booted, self.echo = self.desk.clock.now, Echo()
        self.seqs = {"safety": itertools.count(1), "odometry": itertools.count(1)}

    def _say_the_past(self) -> None:
        """An earlier boot drove and was stopped, and an earlier iVeg told it so."""
        told = FeedbackRef("iveg-before", 7)
        for number in range(200):
            said = origin(number + 1, boot="boot-0", after=-200.0 + number)
            said = replace(said, mono=float(number), acknowledgements=True, heard=told)
            stopped = (FORGOTTEN,) if number > 100 else ()
            self.put(safety_report("AGI", *stopped, origin=said), 60.0)
            self.put(odometry("AGI", linear=0.4, origin=said), 60.0)

    # --- what is said and heard ---------------------------------------------------

    def put(self, one: SafetyReport | Odometry, late_s: float) -> None:
        due = self.desk.clock.now + self.rnd.uniform(0.0, late_s)
        heapq.heappush(self.way, (due, next(self.number), one))

    def origin(self, topic: str) -> Origin:
        now = self.desk.clock.now
        said = origin(next(self.seqs[topic]), boot=f"boot-{self.boots}", after=now)
        return self.echo.on(replace(said, mono=now - self.booted), now)

    def listen(self) -> None:
        """Feedback and STOP reach the robot, late or not at all."""
        now = self.desk.clock.now
        fresh, self.desk.fleet.told = self.desk.fleet.told, []
        self.heard += [(now + self.down_s, one.origin) for one in fresh]
        for due, said in self.heard:
            if due <= now:
                self.echo.note(said, now)
        self.heard = [one for one in self.heard if one[0] > now]
        hold_id = self.desk.commander.machine("AGI").hold_id
        if hold_id is not None and hold_id != FORGOTTEN.id:
            self.holds = (Hold(hold_id, "iveg", "remote"),)

    def speak(self) -> None:
        linear = 0.0 if self.holds else 0.4
        report = safety_report(
            "AGI", *self.holds, linear=linear, origin=self.origin("safety")
        )
        self.put(report, self.late_s)
        self.put(odometry(linear=linear, origin=self.origin("odometry")), self.late_s)

    async def live(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP_S)):
            self.listen()
            self.speak()
            while self.way and self.way[0][0] <= self.desk.clock.now:
                self.desk.hear(heapq.heappop(self.way)[2], FIWARE.id)
            await self.desk.wait(STEP_S)

    async def act(self) -> None:
        """The weather changes, and sometimes the robot reboots."""
        self.late_s = self.rnd.choice(LATE_S)
        self.down_s = self.rnd.choice((0.0, 0.0, 0.3, 3.0))
        if self.rnd.random() < 0.4:
            self.reboot()
        await self.live(self.rnd.choice((0.5, 1.5, 4.0)))

    @property
    def state(self) -> str:
        return self.desk.commander.machine("AGI").state


@pytest.mark.parametrize("batch", range(3))
async def test_the_past_of_a_robot_stops_nobody_and_ends_no_standstill(
    batch: int,
) -> None:
    for number in range(LIVES // 3):
        life = Life(Random(100 * batch + number))  # noqa: S311 - repeatable on purpose
        for _ in range(4):
            await life.act()
        assert (life.state, life.desk.broker.asked) == ("RUNNING", [])

        await life.desk.commander.stop(["AGI"], "ana", life.desk.clock())
        for _ in range(4):
            await life.act()
        # What is under way stays late; what is said from now on comes at once.
        life.late_s = life.down_s = 0.0
        await life.live(4.0)
        assert life.state == "STANDING", f"life {number}"
        await life.live(4.0)

        assert life.state == "STANDING", f"life {number}"
        assert "log.stop.moved" not in life.desk.sentences(), f"life {number}"
