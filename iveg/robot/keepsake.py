"""What a robot keeps while nobody hears it, to be sent when somebody does again.

A ring in memory: the newest ten minutes of poses and pictures at 2 Hz and of what the
robot applied.  Before a gap it holds the newest seconds, since a silence is noticed
after it began.  It is sent slowly, a batch a second, each until the broker has it::

    heard ── silent 1 s ──> gap ── heard for 5 s ──> sending ──> empty
                             ^── silent, or calm is needed ──┘

A STOP and its end come first: after each change of the holds nothing is sent for 10 s.
"""

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, replace

from iveg.domain.backfill import (
    GAP_S,
    KEPT_S,
    MOST_BOXES,
    MOST_MESSAGES,
    OLDEST_S,
    PERIOD_S,
)
from iveg.domain.errors import HopError
from iveg.domain.observations import (
    DetectionFrame,
    Hold,
    Instant,
    Observation,
    Odometry,
    Origin,
    SafetyReport,
)
from iveg.ngsi import codec, names

MOST_KEPT = 4096
"""Observations in the ring; each is below a kilobyte, a picture of 16 boxes below 4."""
MOST_BYTES = 8192
"""Of a batch: 65 ms of a radio link of 1 Mbit/s."""
HEARD_S, CALM_S = 5.0, 10.0
_BEFORE_S = 3.0
_REPORTS_S = 1.0
_EVERY_S = 1.0
_SPARE_S = 30.0
"""Left of the age that iVeg takes: for a batch that has to be sent again."""


@dataclass(frozen=True, slots=True)
class _Kept:
    """An observation with its place in the count; moments are the robot's own."""

    one: Observation
    seq: int
    at: Instant


class Keepsake:
    """Keeps observations of a gap; all moments are on the robot's own clocks.

    Args:
        robot_id: This robot.
        boot: Random text of this start.
        is_on: Whether it keeps anything: a recording tells of another time.
    """

    def __init__(self, robot_id: str, boot: str, *, is_on: bool = True) -> None:
        self._id, self._boot, self._is_on = robot_id, boot, is_on
        self._ring: deque[_Kept] = deque(maxlen=MOST_KEPT)
        self._seq = 0
        self._due: dict[type[Observation], float] = {}
        self._applied: SafetyReport | None = None
        self._holds: tuple[Hold, ...] = ()
        self._calm_at = self._silent_at = 0.0
        self._has_gap = True
        self._sending = 0

    def __len__(self) -> int:
        return len(self._ring)

    def keep(self, one: Observation, at: Instant) -> None:
        """Keep an observation, if it is due."""
        if not self._is_on:
            return
        now = at.mono
        match one:
            case Odometry() if self._is_due(Odometry, now, PERIOD_S):
                self._add(one, at)
            case DetectionFrame(detections=found) if found:
                if self._is_due(DetectionFrame, now, PERIOD_S):
                    surest = sorted(found, key=lambda box: -box.probability)
                    self._add(replace(one, detections=tuple(surest[:MOST_BOXES])), at)
            case SafetyReport():
                self._keep_report(one, at)

    def _keep_report(self, report: SafetyReport, at: Instant) -> None:
        before, self._applied = self._applied, report
        is_news = before is None or _said(before) != _said(report)
        if self._is_due(SafetyReport, at.mono, _REPORTS_S) or is_news:
            self._add(replace(report, released=(), faults=(), challenge=None), at)

    def _is_due(self, kind: type[Observation], now: float, period_s: float) -> bool:
        if now < self._due.get(kind, 0.0):
            return False
        # Half a tick early must not wait a whole tick more.
        self._due[kind] = now + 0.95 * period_s
        return True

    def _add(self, one: Observation, at: Instant) -> None:
        self._seq += 1
        self._ring.append(_Kept(one, self._seq, at))
        oldest = at.mono - (KEPT_S if self._has_gap else _BEFORE_S)
        while not self._has_gap and self._ring[0].at.mono < oldest:
            self._ring.popleft()

    def next_batch(
        self, now: Instant, holds: tuple[Hold, ...], heard_s: float
    ) -> bytes | None:
        """The next batch; None: there is none, or it is not the time.

        It is given again until it ``went``.

        Args:
            now: This moment.
            holds: Of the robot.
            heard_s: Age of the newest feedback (s); infinite without a broker.
        """
        if holds != self._holds:
            self._holds, self._calm_at = holds, now.mono + CALM_S
        if heard_s > GAP_S:
            self._silent_at, self._has_gap = now.mono, True
        self._forget(now.mono)
        is_time = now.mono >= max(self._calm_at, self._silent_at + HEARD_S)
        if not self._has_gap or not is_time:
            return None
        return self._batch(now)

    def went(self) -> None:
        """The broker has the newest batch."""
        for _ in range(min(self._sending, len(self._ring))):
            self._ring.popleft()
        self._sending = 0

    async def send_forever(
        self,
        batch: Callable[[], bytes | None],
        publish: Callable[[str, bytes], Awaitable[None]],
    ) -> None:
        """Send a batch a second until cancelled; one at a time is on its way."""
        topic = names.BACKFILL_TOPIC.format(robot_id=self._id)
        while True:
            await asyncio.sleep(_EVERY_S)
            if (payload := batch()) is not None:
                with suppress(HopError):
                    await publish(topic, payload)
                    self.went()

    def _forget(self, now: float) -> None:
        """Let go of what iVeg would find too old, and of more than ten minutes."""
        newest = self._ring[-1].at.mono if self._ring else now
        oldest = max(newest - KEPT_S, now - (OLDEST_S - _SPARE_S))
        while self._ring and self._ring[0].at.mono < oldest:
            self._ring.popleft()

    def _batch(self, now: Instant) -> bytes | None:
        """What was kept until the robot was heard again, the oldest first."""
        kept, size = list[bytes](), 0
        for one in self._ring:
            if one.at.mono > self._silent_at + GAP_S or len(kept) == MOST_MESSAGES:
                break
            payload = self._write(one)
            size += len(payload)
            if kept and size > MOST_BYTES:
                break
            kept.append(payload)
        self._sending = len(kept)
        if not kept:
            self._has_gap = False
            return None
        sent = Origin(self._boot, None, codec.format_stamp(now.wall), mono=now.mono)
        return codec.write_backfill(self._id, sent, kept)

    def _write(self, kept: _Kept) -> bytes:
        stamp = codec.format_stamp(kept.at.wall)
        origin = Origin(self._boot, kept.seq, stamp, kept.at.wall, kept.at.mono)
        one = replace(kept.one, robot_id=self._id, origin=origin)
        match one:
            case Odometry():
                return codec.write_odometry(one)
            case DetectionFrame():
                return codec.write_detections(one)
        assert isinstance(one, SafetyReport)  # noqa: S101 - nothing else is kept
        return codec.write_safety(one)


def _said(report: SafetyReport) -> tuple[object, ...]:
    """What makes a report news."""
    limit = report.speed_factor, report.reason, report.cause, report.decision_id
    return *limit, report.holds
