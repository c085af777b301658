"""Which detections the history keeps: two a second of each subject, and all evidence.

A detector tells thirty pictures a second, of which a person who stands before a camera
would fill the disk.  Of each robot and subject (a person, a peer, or all boxes of one
class that are neither) one row in half a second is kept, as odometry is; and whatever
these leave out, the detection that a decision rests on (docs/interfaces/http.md,
"Detections that are kept").
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from iveg.domain.limits import LIMITS
from iveg.domain.observations import DetectionFrame, Instant, Received
from iveg.domain.tracking.people import Placed
from iveg.domain.tracking.person import Sighting
from iveg.vital.event_log import EventLog
from iveg.vital.record import ODOMETRY_PERIOD_S

KEPT_EVERY_S = ODOMETRY_PERIOD_S
_MAX_SUBJECTS = 1000


@dataclass(frozen=True, slots=True)
class _Look:
    """One detection with what its row needs; ``is_kept``: it has its row."""

    one: Placed
    frame: DetectionFrame
    received: Received
    is_kept: bool


class KeptDetections:
    """Chooses the detections that become rows.

    A look is remembered while it is the newest of a chain of sightings, because a robot
    may enter the zone of a person seconds after they were seen.
    """

    def __init__(self, event_log: EventLog) -> None:
        self._event_log = event_log
        self._kept_at: dict[tuple[str, str], float] = {}
        self._looks: dict[tuple[str, str], Sequence[_Look]] = {}

    def look(
        self, one: Placed, subject: str, frame: DetectionFrame, received: Received
    ) -> None:
        """Keep a detection if one of its subject is due, and remember it."""
        key, now = (frame.robot_id, subject), received.at.mono
        # Frames come at 10 or 30 Hz: half a frame early must not wait a whole one.
        is_due = now - self._kept_at.get(key, -1e9) >= 0.95 * KEPT_EVERY_S
        if not is_due and one.person is None:
            return
        look = _Look(one, frame, received, is_kept=is_due)
        if is_due:
            self._kept_at[key] = now
            self._record(look)
        if one.person is not None:
            alive = one.person.sightings
            before = self._looks.get(key, ())
            self._looks[key] = [
                *(old for old in before if _is_among(old, alive)),
                look,
            ]

    def keep_evidence(self, person_id: str, sighting: Sighting) -> None:
        """Keep the detection that a decision rests on, unless it has its row."""
        key = sighting.observer, person_id
        looks = self._looks.get(key, ())
        # The newest first: twins of two transports are told apart by nothing.
        for look in reversed(looks):
            if _is_of(look, sighting):
                if not look.is_kept:
                    self._record(look)
                self._looks[key] = [
                    replace(one, is_kept=True) if one is look else one for one in looks
                ]
                return

    def forget(self, now: Instant) -> None:
        """Forget subjects who are gone."""
        if len(self._kept_at) > _MAX_SUBJECTS:
            self._kept_at = {
                key: at
                for key, at in self._kept_at.items()
                if now.mono - at < LIMITS.zone_lasts_s
            }
            self._looks = {
                key: looks for key, looks in self._looks.items() if key in self._kept_at
            }

    def _record(self, look: _Look) -> None:
        self._event_log.detection(look.one, look.frame, look.received)


def _is_among(look: _Look, sightings: Sequence[Sighting]) -> bool:
    return any(_is_of(look, one) for one in sightings)


def _is_of(look: _Look, sighting: Sighting) -> bool:
    """Whether a sighting is of this detection; of one without a place its confidence.

    A doubtful position is its observer's own (``Sighting``).
    """
    one = look.one
    x, y, z = one.position
    is_there = bool(sighting.reach_m) or (sighting.x, sighting.y, sighting.z) == (
        x,
        y,
        z,
    )
    is_same = one.detection.probability == sighting.confidence
    return is_same and is_there and look.frame.robot_id == sighting.observer
