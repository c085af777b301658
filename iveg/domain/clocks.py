"""How late a robot's messages are, estimated from its clock (docs/safety.md, "Age").

A stamp says how long a message travelled, relative to the fastest one of the same boot
and transport within a minute (the minimum filter of NTP).  Seen from one side a delay
that stays the same and a clock that is off look alike, so this is an estimate: it
serves robots that do not echo, and the display of the offset.

A delay lets no stamp fall: a slow transport is never taken for a clock that was set.
A detector may stamp by a clock of its own (simulation time, another zone).  Its frames
are compared with the odometry that came last: farther apart than any frame protects,
they are of another clock, and their age is unknown.
Moments are iVeg's monotonic clock, which nobody sets.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

from iveg.domain.clock_filter import STEP_S, ClockFilter, Kind
from iveg.domain.limits import LIMITS
from iveg.domain.observations import DetectionFrame, Instant, Origin
from iveg.domain.transports import FIWARE, TransportId

_DIRECT_FRESH_S = 10.0
_HEARD_S = 2.0
"""Orion may be told to send one pose a second."""
_TOLERANCE_S = 0.25
_APART_S = 2.0
"""For so long a detector has to be apart before its clock is accused."""
OFFSET_WARN_S, _WARNED_S = 0.25, 60.0
_MAX_FILTERS = 16

_Sender = tuple[TransportId, str | None, bool]
"""Transport, boot, and whether it is the detector."""


@dataclass(slots=True)
class RobotClock:
    """All that is estimated of one robot's clock: a filter a transport and boot.

    Attributes:
        detector_apart_at: When a detection frame was last stamped by another clock than
            odometry (monotonic, s).
        detector_accused_at: When it last had been so for two seconds.
    """

    detector_apart_at: float | None = None
    detector_accused_at: float | None = None
    _apart: tuple[float, float] | None = None
    """Since when frames are apart, and by what (s)."""
    _filters: dict[_Sender, ClockFilter] = field(default_factory=dict)
    _warned: tuple[float, float] = (float("-inf"), 0.0)

    def delay(
        self,
        kind: Kind,
        origin: Origin,
        at: Instant,
        transport: TransportId,
        lag: float | None,
    ) -> float | None:
        """How old a message was when it arrived (s), estimated; None unknown.

        ``lag`` (s) is that of iVeg's own probe through FIWARE, None before one came
        back: what FIWARE alone brings is never younger.
        """
        own = self._filter(transport, origin.boot, kind).observe(kind, origin, at.mono)
        if kind is DetectionFrame:
            beyond = self._beyond_odometry(transport, origin, at.mono)
            if beyond is None:
                if self._hears_odometry(transport, origin, at.mono):
                    self._note_apart(origin, at.mono)
                return None
            self._apart = None
            own = None if own is None else max(own, beyond)
        if transport != FIWARE.id:
            return own
        against_direct = self._against_direct(origin, at.mono)
        if against_direct is not None:
            return max(against_direct, lag or 0.0)
        return None if own is None or lag is None else max(own, lag)

    def _filter(
        self, transport: TransportId, boot: str | None, kind: Kind
    ) -> ClockFilter:
        """The filter of a sender; detectors have their own, which fools no other."""
        sender = transport, boot, kind is DetectionFrame
        if sender not in self._filters:
            while len(self._filters) >= _MAX_FILTERS:
                del self._filters[next(iter(self._filters))]
            self._filters[sender] = ClockFilter()
        return self._filters[sender]

    def _beyond_odometry(
        self, transport: TransportId, origin: Origin, now: float
    ) -> float | None:
        """What a detection frame took beyond the fastest odometry (s), 0 if unknown.

        None where it is stamped by another clock.
        """
        odometry = self._filters.get((transport, origin.boot, False))
        if odometry is None or odometry.newest is None or origin.stamp_s is None:
            return 0.0
        transit = now - origin.stamp_s
        if abs(transit - odometry.newest) > LIMITS.ring_lasts_s:
            return None
        return max(
            0.0, transit - (transit if odometry.least is None else odometry.least)
        )

    def _note_apart(self, origin: Origin, now: float) -> None:
        """Note a frame of another clock, unless it is of a backlog.

        A backlog is worked off: its frames are less late from one to the next.
        """
        assert origin.stamp_s is not None  # noqa: S101 - else nothing is apart
        self.detector_apart_at, transit = now, now - origin.stamp_s
        if self._apart is None or transit < self._apart[1] - STEP_S:
            self._apart = now, transit
        elif now - self._apart[0] >= _APART_S:
            self.detector_accused_at = now

    def _hears_odometry(
        self, transport: TransportId, origin: Origin, now: float
    ) -> bool:
        """Whether odometry came just before, by the same way.

        The first frame behind a gap is as late as the gap was long, and nothing tells
        that from another clock until odometry has passed it, too.
        """
        odometry = self._filters[transport, origin.boot, False]
        return now - odometry.seen_at <= _HEARD_S

    def _against_direct(self, origin: Origin, now: float) -> float | None:
        """The delay against the fastest direct message, while there are such (s)."""
        direct = max(
            (one for boot, one in self._direct() if boot == origin.boot),
            key=lambda one: one.seen_at,
            default=None,
        )
        if direct is None or origin.stamp_s is None or direct.least is None:
            return None
        beyond = now - origin.stamp_s - direct.least
        # Faster than the fastest direct one: the clock was set in between.
        if now - direct.seen_at > _DIRECT_FRESH_S or beyond < -_TOLERANCE_S:
            return None
        return max(0.0, beyond)

    def _direct(self) -> Iterator[tuple[str | None, ClockFilter]]:
        """Boot and filter of what came by another way than FIWARE, detectors apart."""
        for (transport, boot, is_detector), one in self._filters.items():
            if transport != FIWARE.id and not is_detector:
                yield boot, one

    def offset_s(self, now: Instant) -> float | None:
        """How far the robot's clock is behind ours (s), by direct messages alone."""
        direct = (one for _, one in self._direct())
        newest = max(direct, key=lambda one: one.seen_at, default=None)
        if newest is None or newest.least is None:
            return None
        return newest.least + now.wall - now.mono

    def warning(self, now: Instant, late_s: float = 0.0) -> float | None:
        """The offset to warn of (s); a warning lasts a minute, so that none flaps.

        A clock that seems behind by no more than messages may be late (``late_s``) is
        not reported.
        """
        offset = self.offset_s(now)
        if (
            offset is not None
            and not -OFFSET_WARN_S <= offset <= OFFSET_WARN_S + late_s
        ):
            self._warned = (now.mono + _WARNED_S, offset)
        until, warned = self._warned
        return warned if now.mono < until else None
