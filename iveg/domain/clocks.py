"""Delay of a robot's messages, estimated from its clock (docs/safety.md, "Age").

A stamp gives the delay of a message relative to the fastest one of the same boot, kind
and transport within a minute (the minimum filter of NTP).  A constant delay and a wrong
clock look alike, so this is an estimate.  It is used for robots that do not echo, and
for the display of the offset.  Moments are on iVeg's monotonic clock, which nobody
sets.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from iveg.domain.limits import LIMITS
from iveg.domain.observations import DetectionFrame, Instant, Odometry, Origin
from iveg.domain.transports import FIWARE, TransportId

_BUCKET_S, _BUCKETS = 5.0, 12
STEP_S = 0.5
"""Least leap of a clock that is noticed; a smaller leap fades within a minute (s)."""

Kind = type


@dataclass(slots=True)
class ClockFilter:
    """The fastest message of the last minute, of one transport, boot and kind.

    No delay lets a stamp fall, so a slow transport never looks like a clock that was
    set.  A clock was set if stamps fall while seq rises, or if a message beats the
    fastest by more than half a second.  The age of that message is unknown, and the
    filter begins anew with it.

    Attributes:
        least: Arrival less stamp of the fastest message (s); None before the first.
        newest: Likewise of the newest message.
    """

    _buckets: deque[tuple[float, float]] = field(
        default_factory=lambda: deque(maxlen=_BUCKETS)
    )
    _seq: int | None = None
    _stamp_s: float = float("-inf")
    seen_at: float = float("-inf")
    least: float | None = None
    newest: float | None = None

    def observe(self, origin: Origin, now: float) -> float | None:
        """Take one message.

        Returns:
            Delay beyond that of the fastest message (s), 0 without a stamp; None:
            unknown, since the clock was set.
        """
        if origin.stamp_s is None:
            return 0.0
        transit, self.seen_at = now - origin.stamp_s, now
        least = transit if self.least is None else self.least
        seq, before = origin.seq, self._seq
        if seq is not None and before is not None and seq <= before:
            # Out of order: it may be from before the clock was set.
            return max(0.0, transit - least)
        fell = origin.stamp_s < self._stamp_s - STEP_S
        was_set = transit < least - STEP_S or (fell and transit > least + STEP_S)
        self._seq, self._stamp_s, self.newest = seq, origin.stamp_s, transit
        if was_set:
            self._buckets.clear()
        self._note(now, transit)
        return None if was_set else max(0.0, transit - least)

    def _note(self, now: float, transit: float) -> None:
        buckets = self._buckets
        if not buckets or now - buckets[-1][0] > _BUCKET_S:
            buckets.append((now, transit))
        elif transit < buckets[-1][1]:
            buckets[-1] = (buckets[-1][0], transit)
        else:
            return
        self.least = min(transit for _, transit in buckets)


_DIRECT_FRESH_S = 10.0
"""Time after a direct message in which it is compared with (s)."""
_ODOMETRY_FRESH_S = 2.0
"""Time in which odometry is recent: Orion may send one pose a second (s)."""
_TOLERANCE_S = 0.25
_APART_S = 2.0
"""Time apart after which the clock of a detector is accused (s)."""
OFFSET_WARN_S, _WARNED_S = 0.25, 60.0
_MAX_FILTERS = 32

_Stream = tuple[TransportId, str | None, Kind]
"""Transport, boot and kind."""


@dataclass(slots=True)
class RobotClock:
    """Estimate of one robot's clock, with a filter for each stream.

    A detector may stamp by a clock of its own (simulation time, another zone).  Its
    frames are compared with the newest odometry.  If they are farther apart than a
    frame protects, they are of another clock, and their age is unknown.

    Attributes:
        detector_apart_at: Last detection frame that was stamped by another clock than
            odometry (monotonic, s).
        detector_accused_at: Last time at which that had gone on for two seconds
            (monotonic, s).
        _apart: Begin of the frames that are apart (monotonic, s), and by how much (s).
    """

    detector_apart_at: float | None = None
    detector_accused_at: float | None = None
    _apart: tuple[float, float] | None = None
    _filters: dict[_Stream, ClockFilter] = field(default_factory=dict)
    _warned: tuple[float, float] = (float("-inf"), 0.0)

    def delay(
        self,
        kind: Kind,
        origin: Origin,
        at: Instant,
        transport: TransportId,
        lag: float | None,
    ) -> float | None:
        """Estimated age of a message on arrival (s); None: unknown.

        ``lag``: Lag of iVeg's own probe through FIWARE (s), None before the first came
        back.  A message that came only through FIWARE is never younger.
        """
        own = self._filter((transport, origin.boot, kind)).observe(origin, at.mono)
        if kind is DetectionFrame:
            beyond = self._beyond_odometry(transport, origin, at.mono)
            if beyond is None:
                if self._has_odometry(transport, origin, at.mono):
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

    def _filter(self, stream: _Stream) -> ClockFilter:
        """The filter of a stream; the oldest gives way to a new one."""
        # Bounded, since any sender can name new boots.
        if stream not in self._filters:
            while len(self._filters) >= _MAX_FILTERS:
                del self._filters[next(iter(self._filters))]
            self._filters[stream] = ClockFilter()
        return self._filters[stream]

    def _beyond_odometry(
        self, transport: TransportId, origin: Origin, now: float
    ) -> float | None:
        """Delay of a detection frame beyond the fastest odometry (s), 0 if unknown.

        None: it is stamped by another clock.
        """
        odometry = self._filters.get((transport, origin.boot, Odometry))
        if odometry is None or odometry.newest is None or origin.stamp_s is None:
            return 0.0
        transit = now - origin.stamp_s
        if abs(transit - odometry.newest) > LIMITS.zone_lasts_s:
            return None
        return max(
            0.0, transit - (transit if odometry.least is None else odometry.least)
        )

    def _note_apart(self, origin: Origin, now: float) -> None:
        """Note a frame of another clock, unless it is of a backlog.

        The frames of a backlog are less late from one to the next.
        """
        assert origin.stamp_s is not None  # noqa: S101 - else nothing is apart
        self.detector_apart_at, transit = now, now - origin.stamp_s
        if self._apart is None or transit < self._apart[1] - STEP_S:
            self._apart = now, transit
        elif now - self._apart[0] >= _APART_S:
            self.detector_accused_at = now

    def _has_odometry(self, transport: TransportId, origin: Origin, now: float) -> bool:
        """Whether odometry came just before, by the same transport.

        The first frame after a gap is as late as the gap was long.  Only odometry that
        came after the gap as well shows that this is no other clock.
        """
        odometry = self._filters[transport, origin.boot, Odometry]
        return now - odometry.seen_at <= _ODOMETRY_FRESH_S

    def _against_direct(self, origin: Origin, now: float) -> float | None:
        """Delay beyond the fastest direct message (s); None: there is no recent one."""
        direct = self._newest_direct(lambda boot: boot == origin.boot)
        if direct is None or origin.stamp_s is None or direct.least is None:
            return None
        beyond = now - origin.stamp_s - direct.least
        # FIWARE cannot be faster than the direct way: the clock was set in between.
        if now - direct.seen_at > _DIRECT_FRESH_S or beyond < -_TOLERANCE_S:
            return None
        return max(0.0, beyond)

    def _newest_direct(
        self, is_wanted: Callable[[str | None], bool]
    ) -> ClockFilter | None:
        """The filter of the newest direct message of a wanted boot."""
        direct = (
            stream
            for (transport, boot, kind), stream in self._filters.items()
            if transport != FIWARE.id and kind is not DetectionFrame and is_wanted(boot)
        )
        return max(direct, key=lambda stream: stream.seen_at, default=None)

    def offset_s(self, now: Instant) -> float | None:
        """Lag of the robot's clock behind ours (s), by direct messages alone."""
        newest = self._newest_direct(lambda _: True)
        if newest is None or newest.least is None:
            return None
        return newest.least + now.wall - now.mono

    def warning(self, now: Instant, late_s: float = 0.0) -> float | None:
        """The offset to warn of (s); None: none.

        A warning lasts for a minute, so that it does not flap.  A clock that seems
        behind by at most ``late_s``, the delay of messages, is not reported.
        """
        offset = self.offset_s(now)
        if (
            offset is not None
            and not -OFFSET_WARN_S <= offset <= OFFSET_WARN_S + late_s
        ):
            self._warned = (now.mono + _WARNED_S, offset)
        until, warned = self._warned
        return warned if now.mono < until else None
