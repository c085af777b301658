"""What comes back to an episode: answers, safety reports, odometry.

Only a robot's own word moves an episode on; that a road took our message does not.
"""

from collections import deque

from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    CommandAnswer,
    Instant,
    Origin,
    Road,
    SafetyReport,
)
from iveg.domain.stop import releasing
from iveg.domain.stop.commands import Command, Times
from iveg.domain.stop.effects import Effect, SetLevel
from iveg.domain.stop.episode import Episode
from iveg.domain.stop.people import stands

_REMEMBERED = 64


class Heard:
    """The answers that came already, on whatever road."""

    def __init__(self) -> None:
        self._known: deque[tuple[str, int]] = deque(maxlen=_REMEMBERED)

    def is_news(self, origin: Origin) -> bool:
        """Whether this answer is new; one that says no origin always is."""
        if origin.boot is None or origin.seq is None:
            return True
        # The agent's copy has lost its stamp.
        identity = origin.boot, origin.seq
        if identity in self._known:
            return False
        self._known.append(identity)
        return True


# --- answers ----------------------------------------------------------------------


def answered(
    episode: Episode,
    answer: CommandAnswer,
    at: Instant,
    road: Road,
    new_id: str,
    *,
    news: bool,
) -> list[Effect]:
    """The robot's own answer on ``cmdexe`` or ``cmd_info``."""
    attempt = episode.attempt
    if attempt is not None:
        # Without an attempt, a copy of a refusal that was seen already is none of this.
        unknown = answer.attempt is None and answer.result == "REFUSED" and not news
        if unknown or not attempt.is_meant_by(answer):
            return []
        return releasing.answered(episode, attempt, answer, at, road)
    if episode.wants_stop and answer.result == "RELEASED":
        # It will never hold by that name again: only a new one can.
        ours = answer.id == episode.hold_id
        return _lifted(episode, at, new_id) if ours else []
    if episode.stop is None or answer.result != "LATCHED":
        return []
    if episode.hold_id not in {answer.id, *(hold.id for hold in answer.holds)}:
        return []
    episode.stop.note_answer(at, road)
    return _delivered(episode, at)


def _delivered(episode: Episode, at: Instant) -> list[Effect]:
    if episode.state not in ("REQUESTED", "SENT", "UNCONFIRMED"):
        return []
    braking = episode.speed / LIMITS.least_braking_m_s2 + LIMITS.braking_extra_s
    # From the robot's word on: before it, a robot out of reach could not brake.
    episode.deadline = at.mono + min(braking, LIMITS.braking_most_s)
    return [episode.enter("DELIVERED", "delivered")]


# --- reports ----------------------------------------------------------------------


def reported(
    episode: Episode,
    report: SafetyReport,
    at: Instant,
    road: Road,
    new_id: str,
    age_s: float,
    *,
    sparse: bool,
) -> list[Effect]:
    """The robot's safety report, new by (boot, seq), ``age_s`` old at most."""
    episode.report, episode.report_at = report, at
    episode.report_age_then = age_s
    episode.speed = abs(report.linear)
    if episode.state in ("RUNNING", "READY"):
        return _reported_free(episode, report, at)
    if episode.attempt is not None:
        return releasing.reported(episode, episode.attempt, report)
    return _reported_stopped(episode, report, at, road, new_id, sparse=sparse)


def _reported_stopped(
    episode: Episode,
    report: SafetyReport,
    at: Instant,
    road: Road,
    new_id: str,
    *,
    sparse: bool,
) -> list[Effect]:
    assert episode.stop is not None  # noqa: S101 - every such state has an episode
    stood = episode.state in ("STANDING", "STALE")
    if episode.hold_id not in {hold.id for hold in report.holds}:
        episode.standstill.forget()
        if stood or episode.hold_id in report.released:
            return _lifted(episode, at, new_id)
        return []
    if report.challenge != episode.doubt:
        episode.doubt = None
    episode.stop.times.note_word(at, road)
    effects = _delivered(episode, at)
    if stands(report):
        rested = _rested(episode, episode.stop, report, at, sparse=sparse)
        return [*effects, *rested]
    episode.standstill.forget()
    return [*effects, *(episode.again("iveg", at, new_id, "moved") if stood else [])]


def _lifted(episode: Episode, at: Instant, new_id: str) -> list[Effect]:
    """The hold is lost, and nobody has asked for that."""
    key = "moved" if episode.doubt is None else "release_unconfirmed"
    return episode.again("iveg", at, new_id, key)


def _rested(
    episode: Episode, stop: Command, report: SafetyReport, at: Instant, *, sparse: bool
) -> list[Effect]:
    """One more sample at rest; five over a second are a standstill."""
    measured = episode.standstill.rested(at, report.origin, sparse=sparse)
    if not measured or episode.state == "STANDING":
        return []
    if episode.evidence_age(at) > LIMITS.report_stale_s:
        return []  # it stood; nobody knows whether it stands
    if stop.times.standing is None:
        stop.times.standing = first = episode.standstill.since
        assert first is not None  # noqa: S101 - a rest has a first sample
        stop.standstill_ms = stop.times.ms_from_press(first)
    return [episode.enter("STANDING", "standing")]


def _reported_free(episode: Episode, report: SafetyReport, at: Instant) -> list[Effect]:
    if episode.state == "READY" and not report.holds and report.speed_factor > 0:
        return episode.finish("running")
    ours = [hold.id for hold in report.holds if hold.source == "iveg"]
    return _adopt(episode, ours[-1], at) if ours else []


def _adopt(episode: Episode, hold_id: str, at: Instant) -> list[Effect]:
    """A hold of iVeg that this process did not ask for: taken over, never dropped."""
    robot_id = episode.robot_id
    closed = episode.close("adopted")
    times = Times(at)
    episode.stop = Command(hold_id, robot_id, "stop", "DELIVERED", times, ["iveg"])
    episode.doubt = None
    episode.standstill.forget()
    episode.sends.begin()
    episode.sends.now(at)
    episode.deadline = at.mono + LIMITS.braking_most_s
    level = SetLevel(robot_id, "stopped", (hold_id,))
    return [level, *closed, episode.enter("DELIVERED", "adopted")]


# --- odometry ---------------------------------------------------------------------


def moved(
    episode: Episode,
    linear: float,
    angular: float,
    at: Instant,
    new_id: str,
    origin: Origin,
    age_s: float,
) -> list[Effect]:
    """A speed; three moving ones in a row, measured later, contradict a standstill."""
    moves = max(abs(linear), abs(angular)) >= LIMITS.standing_speed
    contradicted = episode.standstill.odometry(at, origin, age_s, moves=moves)
    if contradicted is None:
        return []
    episode.speed = abs(linear)
    if episode.state == "STANDING" and contradicted:
        return episode.again("iveg", at, new_id, "moved")
    return []
