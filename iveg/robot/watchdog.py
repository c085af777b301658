"""Age of iVeg's feedback, judged by the reports that iVeg acknowledges.

A delayed message is not fresh: feedback is as old as the report that it acknowledges,
counted from its sending (docs/interfaces/mqtt.md), not as its own arrival.
"""

from collections import OrderedDict, deque

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
        self._boot_at = boot_at
        self._slow_s = slow_s
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

    def heard(self, seen: int | None, now: float) -> None:
        """Take a feedback that acknowledges the robot's reports up to ``seen``.

        A number that was never sent, or none, is no evidence of freshness.
        """
        self.tick(now)
        evidence = None if seen is None else self._sent.get(seen)
        if evidence is None:
            return
        if self._evidence is None or evidence > self._evidence:
            self._evidence = evidence
        if now - evidence <= self._slow_s:
            if self._fresh_since is None:
                self._fresh_since, self._fresh_count = now, 0
            self._fresh_count += 1

    def tick(self, now: float) -> None:
        """Notice that time has passed: after an interruption freshness counts anew."""
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
        recent = [at for at in self._clears if now - at < _CLEARS_WITHIN_S]
        return len(recent) < _CLEARS
