"""What people do to an episode: press STOP, drill it, release, resume.

A STOP is taken in every state; everything else is refused unless the robot itself has
just said that it may be.
"""

from collections.abc import Iterable
from typing import Literal

from iveg.domain.errors import CommandRefusedError
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, SafetyReport
from iveg.domain.stop.attempt import Attempt
from iveg.domain.stop.commands import Command, Press, Times
from iveg.domain.stop.effects import Changed, Effect, SendOnce
from iveg.domain.stop.episode import Episode
from iveg.domain.stop.table import State, Transport
from iveg.domain.stop.wanted import Wanted


def press(
    episode: Episode, by: str, at: Instant, new_id: str, key: str, press: Press
) -> list[Effect]:
    """STOP: always accepted; a press during an episode joins it."""
    stop = episode.stop
    if episode.wants_stop and episode.state != "RELEASING" and stop is not None:
        episode.joined_at = at.mono
        effects = [] if episode.state == "STANDING" else episode.send_now(at)
        return [*effects, *_join(episode, stop, by)]
    return episode.again(by, at, new_id, key, press)


def restore(episode: Episode, wanted: Wanted, at: Instant, new_id: str) -> list[Effect]:
    """STOP once more what an earlier run had stopped.

    A hold that no release ever named cannot have been lifted, so asserting it again
    adds none.  One that was named may have been: the robot would answer RELEASED and
    hold nothing, so the hold is a new one; unless there are so many that theirs is
    asserted until the robot's word, or its silence, decides.
    """
    kept, doubt = wanted.hold_id, None
    if kept is not None and kept in wanted.named:
        many = len(wanted.asked) >= LIMITS.most_holds
        kept, doubt = (kept, wanted.challenge) if many else (None, None)
    return episode.begin(wanted.by, at, new_id, "reasserted", kept=kept, doubt=doubt)


def _join(episode: Episode, stop: Command, by: str) -> list[Effect]:
    """One more person wants it: nothing changes but the audit."""
    if by in stop.requesters:
        return []
    stop.requesters.append(by)
    why = f"joined by {by}"
    return [Changed(episode.robot_id, stop.command_id, episode.state, "requested", why)]


def drill(
    episode: Episode, by: str, at: Instant, new_id: str, press: Press
) -> list[Effect]:
    """Press STOP to prove that it works, on a robot that hardly moves.

    Raises:
        CommandRefusedError: stopped already, faster than a crawl, or unheard.
    """
    if episode.state != "RUNNING":
        raise _refused(episode, "Drill", f"its state is {episode.state}")
    if episode.report is None or not _is_fresh(episode, at):
        raise _refused(episode, "Drill", "its report is not fresh")
    if max(episode.speed, abs(episode.report.linear)) > LIMITS.drill_speed_m_s:
        raise _refused(episode, "Drill", "it is moving")
    return episode.begin(by, at, new_id, "requested", press)


def release(
    episode: Episode, by: str, seen: Iterable[str], at: Instant, new_id: str
) -> list[Effect]:
    """Lift exactly the holds that a person saw.

    Raises:
        CommandRefusedError: not standing, no fresh report, the set has changed, or
            somebody has just joined the STOP.
    """
    if at.mono - episode.joined_at < LIMITS.joined_unseen_s:
        raise _refused(episode, "Release", "somebody has pressed STOP just now")
    report = _may(episode, "Release", at, allowed=("STANDING", "RUNNING"))
    remote = [hold.id for hold in report.holds if hold.ack == "remote"]
    if set(seen) not in (set(remote), {hold.id for hold in report.holds}):
        raise _refused(episode, "Release", "the holds changed")
    if not remote:
        raise _refused(episode, "Release", "nothing holds it that iVeg may lift")
    return _send_once(episode, "release", by, at, new_id, tuple(remote), report)


def resume(episode: Episode, by: str, at: Instant, new_id: str) -> list[Effect]:
    """Let a released robot drive.

    Raises:
        CommandRefusedError: still held, not standing, or no fresh report.
    """
    report = _may(episode, "Resume", at, allowed=("READY", "RUNNING"))
    if report.holds:
        raise _refused(episode, "Resume", "it is still held")
    return _send_once(episode, "resume", by, at, new_id, (), report)


def _may(
    episode: Episode, asked: str, at: Instant, allowed: tuple[State, ...]
) -> SafetyReport:
    """The fresh report of a robot that stands."""
    report = episode.report
    if episode.state not in allowed:
        raise _refused(episode, asked, f"its state is {episode.state}")
    if report is None or not _is_fresh(episode, at):
        raise _refused(episode, asked, "its report is not fresh")
    if not stands(report):
        raise _refused(episode, asked, "it is moving")
    if report.challenge is None:
        raise _refused(episode, asked, "it gave no challenge")
    return report


def _is_fresh(episode: Episode, at: Instant) -> bool:
    """Whether the robot's last word has just come, and was not old when it came."""
    if episode.report_age(at) > LIMITS.report_fresh_s:
        return False
    return episode.evidence_age(at) <= LIMITS.report_stale_s


def stands(report: SafetyReport) -> bool:
    """Whether a robot says that it is at rest."""
    return max(abs(report.linear), abs(report.angular)) < LIMITS.standing_speed


def _refused(episode: Episode, asked: str, why: str) -> CommandRefusedError:
    return CommandRefusedError(episode.robot_id, asked, why)


def _send_once(
    episode: Episode,
    kind: Literal["release", "resume"],
    by: str,
    at: Instant,
    new_id: str,
    ids: tuple[str, ...],
    report: SafetyReport,
) -> list[Effect]:
    robot_id, challenge = episode.robot_id, report.challenge or ""
    once = Command(new_id, robot_id, kind, "RELEASING", Times(at), [by], tries=1)
    transports: tuple[Transport, ...] = ("direct", "fiware")
    if not episode.sends.has_direct:
        transports, once.roads["direct"] = ("fiware",), "off"
    episode.attempt = Attempt(once, challenge, ids)
    episode.deadline = at.mono + LIMITS.release_within_s
    ours = tuple(hold.id for hold in report.holds if hold.source == "iveg")
    sending = SendOnce(
        robot_id,
        new_id,
        kind,
        challenge,
        transports,
        ids,
        tuple(one for one in ours if one in ids),
    )
    key = "releasing" if kind == "release" else "resuming"
    return [sending, episode.enter("RELEASING", key)]
