"""Comparison of secrets that others send, in constant time."""

import hmac


def same_secret(given: str, known: str) -> bool:
    """Compare in constant time; an empty secret matches nothing."""
    return hmac.compare_digest(given.encode(), known.encode()) and bool(known)
