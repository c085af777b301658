"""What becomes of a release or resume that is under way.

It went out once on each transport, so its copies come in any order, late, or not at
all.  The robot's reports decide, not its answers: one that shows the release makes it
true; a refusal counts once a report shows that the challenge is spent; and without
either the time-out turns it into a STOP, which holds on to what the robot holds, where
that is certain, and is a new one everywhere else.
"""

from iveg.domain.observations import CommandAnswer, Instant, Road, SafetyReport
from iveg.domain.stop.attempt import Attempt
from iveg.domain.stop.effects import Effect, SetLevel
from iveg.domain.stop.episode import Episode
from iveg.domain.stop.table import State


def answered(
    episode: Episode, attempt: Attempt, answer: CommandAnswer, at: Instant, road: Road
) -> list[Effect]:
    """The robot answers a copy."""
    attempt.command.note_answer(at, road)
    if answer.result != "REFUSED":
        return []
    attempt.refused = answer.why or "refused"
    # Its report may have come before the answer.
    return _settle(episode, attempt)


def reported(episode: Episode, attempt: Attempt, report: SafetyReport) -> list[Effect]:
    """A new safety report."""
    if attempt.command.kind == "resume":
        drives = not report.holds and report.speed_factor > 0
        return episode.finish("running") if drives else _settle(episode, attempt)
    if not _is_released(episode, report):
        return _settle(episode, attempt)
    changed = episode.enter("READY", "ready")
    episode.attempt = None
    return [SetLevel(episode.robot_id, "run", ()), changed]


def _is_released(episode: Episode, report: SafetyReport) -> bool:
    ours = episode.hold_id
    if ours is None:
        return all(hold.ack != "remote" for hold in report.holds)
    held = {hold.id for hold in report.holds}
    return ours not in held and ours in report.released


def _settle(episode: Episode, attempt: Attempt) -> list[Effect]:
    """End it if one copy was refused and none can act any more."""
    if attempt.refused is None or not attempt.is_spent(episode.report):
        return []
    if attempt.command.kind == "release" and not _still_held(episode):
        return []
    attempt.command.reason = attempt.refused
    changed = episode.enter(_before(episode, attempt), "refused", attempt.refused)
    episode.attempt = None
    return [changed]


def _still_held(episode: Episode) -> bool:
    ours = episode.hold_id
    if ours is None:
        return any(hold.ack == "remote" for hold in episode.holds)
    return ours in {hold.id for hold in episode.holds}


def _before(episode: Episode, attempt: Attempt) -> State:
    """Where a refused release or resume came from."""
    if episode.stop is None:
        return "RUNNING"
    return "STANDING" if attempt.command.kind == "release" else "READY"


def unconfirmed(
    episode: Episode, attempt: Attempt, at: Instant, new_id: str
) -> list[Effect]:
    """Nothing decided it in time: it becomes a STOP (I7)."""
    key = "release_unconfirmed"
    if attempt.is_spent(episode.report) and episode.shown is not None:
        return episode.begin("iveg", at, new_id, key, kept=episode.shown)
    return episode.again("iveg", at, new_id, key)
