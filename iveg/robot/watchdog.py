"""How old iVeg's word is, judged by what iVeg says it has seen of us.

An old message that arrives again is not fresh: feedback is as old as the moment when we
sent the report that it says it has seen (docs/interfaces/mqtt.md), not as its arrival.
"""

from collections import OrderedDict, deque

_REPORTS_KEPT = 512
_STEADY_S, _STEADY_MESSAGES = 2.0, 4
_CLEARS, _CLEARS_WITHIN_S = 3, 60.0


class Watchdog:
    """Ages feedback; times are monotonic seconds.

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
        """Our safety report ``seq`` left."""
        self._sent[seq] = now
        if len(self._sent) > _REPORTS_KEPT:
            self._sent.popitem(last=False)

    def heard(self, seen: int | None, now: float) -> None:
        """A feedback came; ``seen`` is the newest of our reports that it knows of.

        A number that we never sent, or none, is no evidence of freshness.
        """
        self.look(now)
        evidence = None if seen is None else self._sent.get(seen)
        if evidence is None:
            return
        if self._evidence is None or evidence > self._evidence:
            self._evidence = evidence
        if now - evidence <= self._slow_s:
            if self._fresh_since is None:
                self._fresh_since, self._fresh_count = now, 0
            self._fresh_count += 1

    def look(self, now: float) -> None:
        """Notice that time has passed: freshness that was interrupted starts anew."""
        age = self.age(now)
        if age is None or age > self._slow_s:
            self._fresh_since = None

    def age(self, now: float) -> float | None:
        """Age of the newest feedback (s); None when there never was any."""
        return None if self._evidence is None else max(0.0, now - self._evidence)

    def silence(self, now: float) -> float:
        """Like ``age``, counted from the start of the robot while nothing came (s)."""
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
        """A ``link`` hold cleared itself."""
        self._clears.append(now)

    def may_clear(self, now: float) -> bool:
        """Whether a new ``link`` hold may clear itself: thrice a minute, no more."""
        recent = [at for at in self._clears if now - at < _CLEARS_WITHIN_S]
        return len(recent) < _CLEARS
