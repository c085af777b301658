"""iVeg's feedback on the robot: its age, the people and peers in it, its authors."""

from collections import OrderedDict, deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import chain

from iveg.domain.feedback import (
    FULL_SPEED,
    HALF_SPEED,
    UNSUPERVISED,
    Feedback,
    FeedbackAlert,
    SpeedLimit,
)
from iveg.domain.geometry import REST, Pose2D
from iveg.domain.laser import KnownPeer
from iveg.domain.limits import LIMITS
from iveg.domain.observations import FeedbackRef
from iveg.domain.wire import FORBIDDEN
from iveg.robot.gate import FREE, Cap, CappedZone, known_reason, quantised
from iveg.robot.peer_alerts import (
    PEER_M,
    KeptAlert,
    Neighbour,
    PeerObserver,
    PeerTopic,
    RuleRadii,
    alert_cap,
    alert_zone,
    alerts_of,
    is_alive,
    is_inside,
    limited_free,
    neighbour_of,
    zone_radius,
)

# --- watchdog ---------------------------------------------------------------------
#
# Age of iVeg's feedback, judged by the reports that iVeg acknowledges.
#
# A delayed message is not fresh: the age of feedback counts from the sending of the
# report that it acknowledges (docs/interfaces/mqtt.md), not from its own arrival.

_REPORTS_KEPT = 512
_STEADY_S, _STEADY_MESSAGES = 2.0, 4
_CLEARS, _CLEARS_WITHIN_S = 3, 60.0


class Watchdog:
    """Age of feedback; times are monotonic seconds.

    Args:
        boot_at: When the robot started; silence counts from here.
        slow_s: Feedback older than this is not fresh.
    """

    def __init__(self, boot_at: float, slow_s: float) -> None:
        self._boot_at, self._slow_s = boot_at, slow_s
        self._sent: OrderedDict[int, float] = OrderedDict()
        self._evidence: float | None = None
        self._fresh_since: float | None = None
        self._fresh_count = 0
        self._clears: deque[float] = deque(maxlen=_CLEARS)

    def sent(self, seq: int, now: float) -> None:
        """Note that the safety report ``seq`` was sent."""
        self._sent[seq] = now
        if len(self._sent) > _REPORTS_KEPT:
            self._sent.popitem(last=False)

    def sent_at(self, seq: int | None) -> float | None:
        """Time at which the report ``seq`` was sent; None: it never was."""
        return None if seq is None else self._sent.get(seq)

    def received(self, seq: int | None, now: float) -> None:
        """Take a feedback, of any author, that acknowledges our reports up to ``seq``.

        A number that was never sent, or none, is no evidence of freshness.
        """
        self.tick(now)
        evidence = self.sent_at(seq)
        if evidence is None:
            return
        if self._evidence is None or evidence > self._evidence:
            self._evidence = evidence
        if now - evidence <= self._slow_s:
            if self._fresh_since is None:
                self._fresh_since, self._fresh_count = now, 0
            self._fresh_count += 1

    def tick(self, now: float) -> None:
        """Take note of the time: after an interruption freshness counts anew."""
        age = self.age(now)
        if age is None or age > self._slow_s:
            self._fresh_since = None

    def age(self, now: float) -> float | None:
        """Age of the newest feedback (s); None before the first."""
        return None if self._evidence is None else max(0.0, now - self._evidence)

    def silence(self, now: float) -> float:
        """Like ``age``; before the first feedback, time since the start (s)."""
        return now - (self._boot_at if self._evidence is None else self._evidence)

    def steady(self, now: float) -> bool:
        """Whether feedback has been fresh for 2.0 s and at least four messages."""
        since = self._fresh_since
        return (
            since is not None
            and now - since >= _STEADY_S
            and self._fresh_count >= _STEADY_MESSAGES
        )

    def cleared(self, now: float) -> None:
        """Note that a ``link`` hold cleared itself."""
        self._clears.append(now)

    def may_clear(self, now: float) -> bool:
        """Whether a new ``link`` hold may clear itself: at most thrice a minute."""
        # A radio that comes and goes must not start the robot again and again.
        recent = [at for at in self._clears if now - at < _CLEARS_WITHIN_S]
        return len(recent) < _CLEARS


# --- peer feedback ----------------------------------------------------------------
#
# Feedback of every peer topic of one author: the people and peers that it names.
#
# Algorithm 3 of the paper, judged against the robot's own pose. It differs in four
# ways. A person missing from a message ages out instead of being dropped. A radius
# grows while its topic is silent (docs/safety.md). A peer known to stand slows nobody.
# An alert about the robot itself is ignored, or the robot would slow for ever.

MYSELF_WITHIN_M = 1.0
_MAX_TOPICS, _MAX_ALERTS = 64, 512


class PeerFeedback:
    """All feedback that one robot received of one author.

    Args:
        robot_id: Robot whose speed limits count.
    """

    def __init__(self, robot_id: str) -> None:
        self._me = robot_id
        self._topics: dict[str, PeerTopic] = {}
        self._radii = RuleRadii()

    def newest(self, topic: str) -> int:
        """Count of the newest message of a topic; −1 before the first."""
        state = self._topics.get(topic)
        return -1 if state is None else state.seq

    def apply(
        self, topic: str, feedback: Feedback, own: Pose2D | None, now: float
    ) -> None:
        """Apply the newest message of ``topic``."""
        state = self._topics.get(topic)
        if state is None:
            state = PeerTopic(now)
            self._make_room()
            self._topics[topic] = state
        state.seq, state.at = feedback.origin.seq or 0, now
        state.peer = self._peer(state, feedback, now)
        # Without a name it is not supervised (docs/safety.md, "Clear"): half speed.
        state.speed_limit = feedback.speed_limits.get(self._me, UNSUPERVISED)
        state.foresight = feedback.foresight
        self._radii.note(feedback.rule.get("radius_m", {}), now)
        self._remember(state, feedback, own, now)

    def peers(self, now: float) -> Iterator[KnownPeer]:
        """Every peer whose pose is at most a second old, at that pose."""
        for topic in self._topics.values():
            if topic.peer is not None and now - topic.peer.at <= LIMITS.silence_s:
                yield KnownPeer(topic.peer.pose, topic.peer.stands)

    def caps(self, own: Pose2D | None, slowed: bool, now: float) -> Iterator[Cap]:
        """All caps on this robot at pose ``own`` in ``map``.

        Args:
            own: None while the robot is not localised.
            slowed: The robot is slow for a person or peer: zones are 0.3 m wider.
            now: Monotonic (s).
        """
        beyond = LIMITS.release_beyond_m if slowed else 0.0
        radius_m = self._radii.fresh_m("robot", now)
        for name, topic in self._topics.items():
            silence = now - topic.at
            if silence > LIMITS.zone_lasts_s:
                continue
            yield _mandated(topic.speed_limit, silence)
            for item in topic.alerts.values():
                if item.myself or not is_alive(item, topic, now):
                    continue
                zone_m = zone_radius(item.alert, self._radii, silence, now) + beyond
                if is_inside(item.alert, topic.peer, own, zone_m):
                    # The second for which a missing alert is kept is its release delay.
                    yield alert_cap(item.alert, waits=item.missing_since is None)
            if topic.peer is not None and own is not None:
                yield topic.peer.cap(name, own, radius_m, beyond, now)

    def capped_zones(self, now: float) -> Iterator[CappedZone]:
        """Zones whose motion is known, where the rule looks ahead."""
        for name, topic in self._topics.items():
            if not topic.foresight or now - topic.at > LIMITS.silence_s:
                continue
            for item in topic.alerts.values():
                if not item.myself and item.missing_since is None:
                    yield from alert_zone(item, self._radii, now)
            peer = topic.peer
            if peer is not None and not peer.stands:
                yield from peer.zone(name, self._radii.fresh_m("robot", now), now)

    def neighbours(self, now: float) -> Iterator[Neighbour]:
        """People and robots of messages that are young enough to give positions.

        A peer whose pose stays the same message for ``zone_lasts_s`` is left out, as it
        may be anywhere or gone.
        """
        for name, topic in self._topics.items():
            if now - topic.at > LIMITS.feedback_stand_s:
                continue
            for item in topic.alerts.values():
                if not item.myself and item.missing_since is None:
                    yield from neighbour_of(item.alert, self._radii, now)
            peer = topic.peer
            if peer is not None and now - peer.at <= LIMITS.zone_lasts_s:
                zone_m = self._radii.fresh_m("robot", now)
                x, y = peer.pose.x, peer.pose.y
                yield Neighbour("robot", name, x, y, PEER_M, zone_m)

    def _peer(
        self, topic: PeerTopic, feedback: Feedback, now: float
    ) -> PeerObserver | None:
        if feedback.robot_id == self._me or feedback.pose is None:
            return None
        before, stamp = topic.peer, feedback.pose_stamp
        # A pose with the stamp of before was not measured anew: its age goes on.
        if before is not None and stamp is not None and before.stamp == stamp:
            return replace(before, pose=feedback.pose)
        pose, twist, stands = feedback.pose, feedback.twist or REST, False
        motion = topic.track.note_odometry(pose, twist, now)
        if feedback.twist is not None:
            stands = not motion.moves
        pose, twist = motion.ahead(pose, twist)
        return PeerObserver(pose, twist.linear_x, stands, stamp, now)

    def _make_room(self) -> None:
        # The longest silent topic gives way: its zones end first.
        if len(self._topics) >= _MAX_TOPICS:
            del self._topics[min(self._topics, key=lambda name: self._topics[name].at)]

    def _remember(
        self, topic: PeerTopic, feedback: Feedback, own: Pose2D | None, now: float
    ) -> None:
        received = alerts_of(feedback)
        alerts = {
            key: known
            for key, known in topic.alerts.items()
            if is_alive(known, topic, now)
        }
        for key, known in alerts.items():
            if key not in received and known.missing_since is None:
                alerts[key] = replace(known, missing_since=now)
        for key, alert in received.items():
            myself = self._is_me(alert, topic, own, alerts.get(key))
            alerts[key] = KeptAlert(alert, now, None, myself)
        topic.alerts = dict(list(alerts.items())[-_MAX_ALERTS:])

    def _is_me(
        self,
        alert: FeedbackAlert,
        topic: PeerTopic,
        own: Pose2D | None,
        before: KeptAlert | None,
    ) -> bool:
        # The robot's own detections never show itself.
        if alert.class_ != "robot" or alert.observer == self._me:
            return False
        if alert.class_id == self._me or limited_free(topic.speed_limit, alert):
            return True
        if alert.position is None or own is None:
            return False
        near = own.distance_to(*alert.position[:2]) <= MYSELF_WITHIN_M
        # The robot has moved on from the place where it was detected.
        is_still_there = (
            before is not None
            and before.myself
            and before.alert.position == alert.position
        )
        return near or is_still_there


def _mandated(speed_limit: SpeedLimit, silence: float) -> Cap:
    """The cap that iVeg asks for; after a second of silence at least half speed."""
    factor = quantised(speed_limit.speed_factor)
    # R7 decides when a silent iVeg makes a robot stand, not its last word.
    if silence > LIMITS.silence_s:
        factor = max(factor, HALF_SPEED)
    if factor == FULL_SPEED:
        return FREE
    reason, decision_id = known_reason(speed_limit.reason), speed_limit.decision_id
    return Cap(factor, reason, speed_limit.cause, decision_id, not speed_limit.over)


# --- authors ----------------------------------------------------------------------
#
# Authors of feedback, each kept apart; the lowest limit of any is applied.
#
# An author is one run of an iVeg, named by the ``boot`` of its messages. A message that
# does not continue its count belongs to another author of that name. So no message,
# whatever its number, makes a robot drop iVeg's next ones. An author that is silent for
# a second counts as half speed, and is forgotten ten seconds after its last message
# (docs/safety.md, "Silence is not full speed").

MOST_AUTHORS = 4
"""More than a site has; one more is half speed, since any of them may be false."""
_COPIES_KNOWN = 64
_MOMENTS_KEPT = 4096
"""Messages whose moments are kept: of ten seconds and more, with twenty robots."""
_MOST_NEIGHBOURS = 256
_SILENT = Cap(HALF_SPEED, "watchdog")


@dataclass(slots=True)
class Author:
    """One author and its feedback.

    Attributes:
        newest: Its highest ``seq``, which goes over all topics.
        received_at: When its newest message came (monotonic, s).
        seen_at: When the newest of our reports that it has seen was sent (monotonic,
            s); None: it has seen none.
        backlog_s: Orion's backlog as it reports it (s); None: unknown.
        recent: Its newest messages, by which copies are recognised.
    """

    boot: str
    peer_feedback: PeerFeedback
    newest: int
    received_at: float
    seen_at: float | None = None
    backlog_s: float | None = None
    recent: deque[Feedback] = field(default_factory=lambda: deque(maxlen=_COPIES_KNOWN))

    def is_silent(self, slow_s: float, now: float) -> bool:
        """Whether it has seen no report of the last ``slow_s`` (s)."""
        return self.seen_at is None or now - self.seen_at > slow_s


class Authors:
    """All feedback that one robot received, by author.

    Args:
        robot_id: Robot whose speed limits count.
        slow_s: Feedback older than this halves the speed.
    """

    def __init__(self, robot_id: str, slow_s: float) -> None:
        self._me, self._slow_s = robot_id, slow_s
        self._kept: list[Author] = []
        """Authors in the order of their first messages."""
        self._crowded_at = float("-inf")
        self._newest: deque[tuple[tuple[float, FeedbackRef], ...]] = deque(
            maxlen=_MOMENTS_KEPT
        )
        """Newest message of each author, and when it came, after each message."""
        self.newest_stamp_s: float | None = None
        """Stamp of the newest message, by iVeg's clock (Unix s)."""

    def apply(
        self,
        topic: str,
        feedback: Feedback,
        own: Pose2D | None,
        seen_at: float | None,
        now: float,
    ) -> bool:
        """Apply a message of ``topic``.

        Args:
            topic: Robot of its topic.
            feedback: The message.
            own: The robot's pose; None while it is not localised.
            seen_at: When the report that it has seen was sent; None: it has seen none.
            now: Monotonic (s).

        Returns:
            Whether it is news. Copies are not, nor messages without a count or with
            an unusable name.
        """
        boot, seq = feedback.origin.boot, feedback.origin.seq
        self._forget(now)
        # The robot echoes the name, and Orion would refuse its reports with such text.
        if not boot or seq is None or not FORBIDDEN.isdisjoint(boot):
            return False
        if self._is_copy(topic, feedback, boot, seq):
            return False
        author = self._author_of(topic, boot, seq, now)
        if author is None:
            return True
        author.newest, author.received_at = max(author.newest, seq), now
        if seen_at is not None:
            author.seen_at = max(seen_at, author.seen_at or seen_at)
        author.backlog_s = feedback.backlog_s
        author.recent.append(feedback)
        author.peer_feedback.apply(topic, feedback, own, now)
        self._newest.append(
            tuple(
                (author.received_at, FeedbackRef(author.boot, author.newest))
                for author in self._kept
            )
        )
        self.newest_stamp_s = feedback.origin.stamp_s or self.newest_stamp_s
        return True

    def echoes(self, at: float) -> tuple[FeedbackRef, ...]:
        """Newest message of each author by a moment, the author known longest first.

        Once all are forgotten, that of the last author; empty before the first, and for
        a moment before those that are kept.
        """
        for newest in reversed(self._newest):
            last = max(came for came, _ in newest)
            if last <= at:
                kept_from = min(last, at - LIMITS.zone_lasts_s)
                return tuple(ref for came, ref in newest if came >= kept_from)
        return ()

    def backlog_s(self) -> float | None:
        """Largest backlog of Orion that an author reports (s); None where none does."""
        reported = (author.backlog_s for author in self._kept)
        return max(
            (backlog_s for backlog_s in reported if backlog_s is not None), default=None
        )

    def caps(self, own: Pose2D | None, slowed: bool, now: float) -> Iterator[Cap]:
        """All caps of all authors; arguments as of :meth:`PeerFeedback.caps`."""
        self._forget(now)
        for author in self._kept:
            if author.is_silent(self._slow_s, now):
                yield _SILENT
            yield from author.peer_feedback.caps(own, slowed, now)
        if now - self._crowded_at <= LIMITS.zone_lasts_s:
            yield _SILENT

    def capped_zones(self, now: float) -> Iterable[CappedZone]:
        """Zones whose motion is known, where an author's rule looks ahead."""
        return chain.from_iterable(
            author.peer_feedback.capped_zones(now) for author in self._kept
        )

    def peers(self, now: float) -> Iterable[KnownPeer]:
        """Peers that explain what the laser sees; none while two authors speak."""
        self._forget(now)
        # A false author could explain a person away, and either may be false.
        return self._kept[0].peer_feedback.peers(now) if len(self._kept) == 1 else ()

    def neighbours(self, now: float) -> list[Neighbour]:
        """People and peers of all authors; two of a kind in a place are merged."""
        neighbours = chain.from_iterable(
            author.peer_feedback.neighbours(now) for author in self._kept
        )
        places = {
            (near.kind, round(near.x, 1), round(near.y, 1)): near for near in neighbours
        }
        return [*places.values()][:_MOST_NEIGHBOURS]

    def _forget(self, now: float) -> None:
        last = now - LIMITS.zone_lasts_s
        self._kept = [author for author in self._kept if author.received_at >= last]

    def _named(self, boot: str) -> Iterator[Author]:
        return (author for author in self._kept if author.boot == boot)

    def _is_copy(self, topic: str, feedback: Feedback, boot: str, seq: int) -> bool:
        # By content too: a stranger's message may bear a number of iVeg's count.
        return any(
            seq <= author.peer_feedback.newest(topic) and feedback in author.recent
            for author in self._named(boot)
        )

    def _author_of(self, topic: str, boot: str, seq: int, now: float) -> Author | None:
        """Author whose count a message continues, or a new author; None: no room."""
        counts = [
            author
            for author in self._named(boot)
            if seq > author.peer_feedback.newest(topic)
        ]
        if counts:
            return min(counts, key=lambda author: abs(seq - author.newest))
        if len(self._kept) >= MOST_AUTHORS:
            self._crowded_at = now
            quiet = min(self._kept, key=lambda author: author.received_at)
            if now - quiet.received_at <= LIMITS.silence_s:
                return None
            self._kept.remove(quiet)
        author = Author(boot, PeerFeedback(self._me), seq, now)
        self._kept.append(author)
        return author
