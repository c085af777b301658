"""Numbers in the cells of the report's tables."""

from collections.abc import Mapping


def interval(rate: Mapping[str, float] | None) -> str:
    """One share with its interval of confidence in a table; a dash for none."""
    if rate is None:
        return "–"
    share, low, high = (100.0 * rate[name] for name in ("share", "low", "high"))
    return f"{share:.1f} % [{low:.1f}, {high:.1f}]"


def percent(share: float | None) -> str:
    """One share in a table."""
    return "–" if share is None else f"{share:.1%}"


def seconds(value: float | None) -> str:
    """One delay in a table (s)."""
    return "–" if value is None else f"{value:.2f}"


def ms(value: float | None) -> str:
    """One duration in a table."""
    return "–" if value is None else f"{value:.1f}"
