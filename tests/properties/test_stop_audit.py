"""I9 across kills: one audit row for each STOP, RELEASE, time-out and lost hold.

Lives of iVeg that share one disk and nothing else.  In each a person and a robot do
what a seed has drawn; then the power goes, now and then while the disk hangs.  What
happened is read from the log and the transports of each life, what was kept from the
disk.
"""

import asyncio
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field, replace
from random import Random

import pytest

from iveg.domain.errors import CommandRefusedError
from iveg.domain.observations import Hold
from iveg.domain.records import CommandEventRecord, CommandRecord, Record
from iveg.domain.stop import DesiredRecord
from tests.fakes.journal import FakeJournal
from tests.unit.vital.desk import Desk, settle

pytestmark = pytest.mark.slow
TOLD = (
    *("reasserted", "adopted", "releasing", "resuming", "ready", "refused", "running"),
    *("unconfirmed", "still_moving", "stale", "moved", "release_unconfirmed"),
)
ENDED = ("RUNNING", "REPLACED", "EXPIRED")


@dataclass
class Disk:
    """What outlives a life, as the database and the journal keep it."""

    commands: dict[str, CommandRecord] = field(default_factory=dict)
    events: dict[CommandEventRecord, None] = field(default_factory=dict)
    wanted: dict[str, DesiredRecord] = field(default_factory=dict)

    def take(self, records: list[Record], journal: FakeJournal) -> None:
        for record in records:
            if isinstance(record, CommandRecord):
                self.commands[record.command_id] = record
            elif isinstance(record, CommandEventRecord):
                # The table's identity is the whole row, so a copy changes nothing.
                self.events[record] = None
        for robot_id, desired, hold_id, by in journal.lines:
            self.wanted.pop(robot_id, None)
            if desired == "stopped":
                self.wanted[robot_id] = DesiredRecord(by, hold_id)
        for robot_id, _, named, challenge in journal.named_lines:
            if robot_id in self.wanted:
                self.wanted[robot_id] = replace(
                    self.wanted[robot_id],
                    named=named,
                    open_release=named,
                    challenge=challenge,
                )

    def left_open(self) -> list[CommandRecord]:
        """As ``Queries.left_open``."""
        return [
            row
            for row in self.commands.values()
            if (row.kind == "stop" and row.state not in ENDED)
            or (row.kind != "stop" and row.state == "RELEASING")
        ]


class Life(Desk):
    """One run of iVeg, with its robot."""

    def __init__(self, disk: Disk, earlier: "Life | None") -> None:
        super().__init__(("AGI",))
        self.disk = disk
        self.accepted: list[str] = []
        if earlier is not None:
            self.clock.now = earlier.clock.now + 2.0
            self.ids.given += earlier.ids.given
            self.seq = earlier.seq + 1000
        self.holds: tuple[str, ...] = () if earlier is None else earlier.holds
        self.lifted: tuple[str, ...] = () if earlier is None else earlier.lifted
        self.speed = 0.0
        self.driving = False

    async def begin(self) -> None:
        self.commander.restore(self.disk.wanted, self.clock())
        self.commander.close_earlier(self.disk.left_open(), self.clock())
        await settle()

    # --- the robot ------------------------------------------------------------------

    async def robot_lives(self, seconds: float) -> None:
        """It latches what was sent to it, obeys releases and says so."""
        for _ in range(round(seconds / 0.1)):
            self._obey()
            self.report(
                "AGI",
                *(Hold(one, "iveg", "remote") for one in self.holds),
                released=self.lifted[-64:],
                linear=self.speed,
                factor=float(self.driving),
                reason="clear" if self.driving else "hold",
            )
            await self.wait(0.1)

    def _obey(self) -> None:
        for what, _, ids in self.broker.asked[self._heard :]:
            fresh = tuple(i for i in ids if i not in (*self.holds, *self.lifted))
            if what == "stop":
                self.holds, self.driving = (*self.holds, *fresh), False
            elif what == "release" and set(ids) >= set(self.holds):
                self.holds, self.lifted = (), (*self.lifted, *ids)
            elif what == "resume":
                self.driving = not self.holds
        self._heard = len(self.broker.asked)

    _heard = 0

    # --- what a seed draws ----------------------------------------------------------

    async def press(self, by: str) -> None:
        (command,) = await self.commander.stop(["AGI"], by, self.clock())
        self.accepted.append(command.command_id)

    async def free(self) -> None:
        """Release if that may be, else resume."""
        try:
            await self.commander.release("AGI", self.holds, "ana", self.clock())
        except CommandRefusedError:
            with suppress(CommandRefusedError):
                await self.commander.resume("AGI", "ana", self.clock())
        await settle()

    async def silence(self) -> None:
        await self.wait(2.4)

    async def loses_a_hold(self) -> None:
        self.holds, self.lifted = (), (*self.lifted, *self.holds)
        await self.robot_lives(0.2)

    async def is_pushed(self) -> None:
        self.speed = 0.4
        await self.robot_lives(2.0)
        self.speed = 0.0

    async def stands(self) -> None:
        await self.robot_lives(2.5)


async def live(life: Life, rnd: Random) -> None:
    await life.begin()
    for _ in range(rnd.randint(1, 7)):
        match rnd.choice(("press", "free", "free", "wait", "wait", "odd", "short")):
            case "press":
                await life.press(rnd.choice(("ana", "ben")))
            case "free":
                await life.free()
            case "wait":
                await life.stands()
            case "short":
                await life.robot_lives(rnd.choice((0.1, 0.3, 0.6)))
            case _:
                odd = (life.silence, life.loses_a_hold, life.is_pushed)
                await rnd.choice(odd)()
    await settle()


def told(life: Life) -> Counter[tuple[float, str]]:
    """What people saw happen: when, and what."""
    lines = (
        (line.at, line.key.removeprefix("log.stop.")) for line in life.event_log.lines
    )
    return Counter((at, key) for at, key in lines if key in TOLD)


def kept(disk: Disk) -> Counter[tuple[float, str]]:
    """The audit rows of the same; what only closes another command is left out."""
    rows = (one for one in disk.events if one.state not in ("REPLACED", "EXPIRED"))
    return Counter((one.at, one.why) for one in rows if one.why in TOLD)


def die(life: Life) -> None:
    """The power goes: only what is on the disk stays."""
    life.disk.take(life.sink.durable, life.journal)


async def die_while_the_disk_hangs(life: Life) -> None:
    """Somebody presses and somebody releases, and neither gets an answer."""
    released = [one for one in life.broker.asked if one[0] == "release"]
    life.sink.opened.clear()
    await life.free()
    pressing = asyncio.create_task(life.press("carl"))
    await life.wait(0.3)

    assert not pressing.done(), "accepted, and not on the disk"
    assert [one for one in life.broker.asked if one[0] == "release"] == released
    assert life.fleet.stops, "a STOP waits for no disk"
    die(life)
    pressing.cancel()


@pytest.mark.parametrize("seed", range(30))
async def test_i9_what_people_saw_has_one_audit_row_over_ten_kills(seed: int) -> None:
    rnd = Random(seed)  # noqa: S311 - repeatable on purpose
    disk, life = Disk(), None
    seen, accepted = Counter[tuple[float, str]](), set[str]()
    for _ in range(10):
        life = Life(disk, life)
        await live(life, rnd)
        die(life)
        seen += told(life)
        accepted |= set(life.accepted)
        await life.commander.close()

    rows = [one for one in disk.events if one.state != "REPLACED"]
    assert kept(disk) == seen
    pressed = Counter(one.command_id for one in rows if one.why == "requested")
    assert set(pressed.values()) <= {1}
    assert set(pressed) <= accepted <= {one.command_id for one in rows}
    assert seen


@pytest.mark.parametrize("seed", range(30))
async def test_i9_a_disk_that_hangs_when_the_power_goes_loses_nothing_accepted(
    seed: int,
) -> None:
    rnd = Random(seed)  # noqa: S311 - repeatable on purpose
    disk, life = Disk(), None
    seen = Counter[tuple[float, str]]()
    for _ in range(10):
        life = Life(disk, life)
        await live(life, rnd)
        seen += told(life)
        await die_while_the_disk_hangs(life)
        await life.commander.close()

    assert kept(disk) == seen


@pytest.mark.parametrize("seed", range(30))
async def test_after_a_restart_only_what_is_followed_is_open(seed: int) -> None:
    rnd = Random(seed)  # noqa: S311 - repeatable on purpose
    disk, life = Disk(), None
    for _ in range(5):
        life = Life(disk, life)
        await live(life, rnd)
        await life.press("ana")
        die(life)
        await life.commander.close()
    left = {row.command_id for row in disk.left_open()}

    life = Life(disk, life)
    await life.begin()
    die(life)
    await life.commander.close()

    stop = life.commander.machine("AGI").stop
    followed = set() if stop is None else {stop.command_id}
    assert {row.command_id for row in disk.left_open()} <= followed
    closing = Counter(
        one.command_id for one in disk.events if one.why.startswith("server restarted")
    )
    assert left
    assert all(closing[one] == 1 for one in left)
