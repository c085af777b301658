"""What comes back to an episode: answers, safety reports, odometry.

Only a robot's own word moves an episode on; that a road took our message does not.
"""

from collections import deque

from iveg.domain.observations import (
    CommandAnswer,
    Instant,
    Origin,
    Road,
    SafetyReport,
)
from iveg.domain.stop.commands import Command, Times
from iveg.domain.stop.effects import Effect, SetLevel
from iveg.domain.stop.episode import STALE_S, Episode
from iveg.domain.stop.people import stands
from iveg.domain.stop.table import State
from iveg.domain.world import STANDING_SPEED

ASSUMED_BRAKING = 0.5
"""Least braking that may be counted on (m/s²)."""
BRAKING_EXTRA_S, BRAKING_CAP_S = 1.5, 5.0
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
    episode: Episode, answer: CommandAnswer, at: Instant, road: Road, *, news: bool
) -> list[Effect]:
    """The robot's own answer on ``cmdexe`` or ``cmd_info``."""
    if episode.state == "RELEASING" and episode.once is not None:
        if answer.result == "REFUSED" and not news:
            # The other road's copy of a refusal that a person has seen already.
            return []
        return _answered_once(episode, episode.once, answer, at, road)
    if episode.stop is None or answer.result != "LATCHED":
        return []
    if episode.hold_id not in {answer.id, *(hold.id for hold in answer.holds)}:
        return []
    _note_answer(episode.stop.times, at, road)
    return _delivered(episode, at)


def _answered_once(
    episode: Episode, once: Command, answer: CommandAnswer, at: Instant, road: Road
) -> list[Effect]:
    if answer.result not in ("REFUSED", "RELEASED", "RESUMED"):
        return []
    _note_answer(once.times, at, road)
    if answer.result != "REFUSED":
        return []
    once.reason = answer.why
    changed = episode.enter(_before(episode, once), "refused", answer.why)
    episode.once = None
    return [changed]


def _before(episode: Episode, once: Command) -> State:
    """Where a refused release or resume came from."""
    if episode.stop is None:
        return "RUNNING"
    return "STANDING" if once.kind == "release" else "READY"


def _delivered(episode: Episode, at: Instant) -> list[Effect]:
    if episode.state not in ("REQUESTED", "SENT", "UNCONFIRMED"):
        return []
    braking = min(episode.speed / ASSUMED_BRAKING + BRAKING_EXTRA_S, BRAKING_CAP_S)
    # From the robot's word on: before it, a robot out of reach could not brake.
    episode.deadline = at.mono + braking
    return [episode.enter("DELIVERED", "delivered")]


def _note_answer(times: Times, at: Instant, road: Road) -> None:
    if road == "mqtt":
        times.answer_direct = times.answer_direct or at
    else:
        times.answer_fiware = times.answer_fiware or at


# --- reports ----------------------------------------------------------------------


def reported(
    episode: Episode,
    report: SafetyReport,
    at: Instant,
    road: Road,
    new_id: str,
    age_s: float,
) -> list[Effect]:
    """The robot's safety report, new by (boot, seq), ``age_s`` old at most."""
    episode.report, episode.report_at = report, at
    episode.report_age_then = age_s
    episode.speed = abs(report.linear)
    if episode.state in ("RUNNING", "READY"):
        return _reported_free(episode, report, at)
    if episode.state == "RELEASING":
        return _reported_releasing(episode, report)
    return _reported_stopped(episode, report, at, road, new_id)


def _reported_stopped(
    episode: Episode, report: SafetyReport, at: Instant, road: Road, new_id: str
) -> list[Effect]:
    assert episode.stop is not None  # noqa: S101 - every such state has an episode
    stood = episode.state in ("STANDING", "STALE")
    if episode.hold_id not in {hold.id for hold in report.holds}:
        episode.standstill.forget()
        # A name that was released never holds again: only a new one can.
        if stood or episode.hold_id in report.released:
            return episode.begin("iveg", at, new_id, "moved")
        return []
    _note_answer(episode.stop.times, at, road)
    effects = _delivered(episode, at)
    if stands(report):
        return [*effects, *_rested(episode, episode.stop, report, at)]
    episode.standstill.forget()
    return [*effects, *(episode.begin("iveg", at, new_id, "moved") if stood else [])]


def _rested(
    episode: Episode, stop: Command, report: SafetyReport, at: Instant
) -> list[Effect]:
    """One more sample at rest; five over a second are a standstill."""
    measured = episode.standstill.rested(at, report.origin)
    if not measured or episode.state == "STANDING":
        return []
    if episode.evidence_age(at) > STALE_S:
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
    episode.standstill.forget()
    episode.sends.begin()
    episode.sends.now(at)
    episode.deadline = at.mono + BRAKING_CAP_S
    level = SetLevel(robot_id, "stopped", (hold_id,))
    return [level, *closed, episode.enter("DELIVERED", "adopted")]


def _reported_releasing(episode: Episode, report: SafetyReport) -> list[Effect]:
    assert episode.once is not None  # noqa: S101 - RELEASING has one
    if episode.once.kind == "resume":
        drives = not report.holds and report.speed_factor > 0
        return episode.finish("running") if drives else []
    ours = episode.hold_id
    if ours is None and any(hold.ack == "remote" for hold in report.holds):
        return []
    held = {hold.id for hold in report.holds}
    if ours is not None and (ours in held or ours not in report.released):
        return []
    changed = episode.enter("READY", "ready")
    episode.once = None
    return [SetLevel(episode.robot_id, "run", ()), changed]


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
    moves = max(abs(linear), abs(angular)) >= STANDING_SPEED
    contradicted = episode.standstill.odometry(at, origin, age_s, moves=moves)
    if contradicted is None:
        return []
    episode.speed = abs(linear)
    if episode.state == "STANDING" and contradicted:
        return episode.begin("iveg", at, new_id, "moved")
    return []
