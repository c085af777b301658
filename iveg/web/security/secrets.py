"""Secrets that others send, compared in constant time."""

import hmac


class NotifySecret:
    """The secret that Orion sends with each notification.

    Args:
        current: What new subscriptions carry.
        previous: Still taken while the secret is being changed; empty: none.
    """

    def __init__(self, current: str, previous: str = "") -> None:
        self.current = current
        self._previous = previous

    def admits(self, given: str | None) -> bool:
        """Whether a notification with this ``X-Iveg-Notify-Token`` is Orion's."""
        if not given:
            return False
        # Both are always compared, so that time does not tell which one matched.
        matches = [
            same_secret(given, known) for known in (self.current, self._previous)
        ]
        return any(matches)


def same_secret(given: str, known: str) -> bool:
    """Compare in constant time; an empty secret matches nothing."""
    return hmac.compare_digest(given.encode(), known.encode()) and bool(known)
