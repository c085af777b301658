"""Health of the data path, latency hop by hop, and recordings."""

from typing import Literal

from iveg.domain.latency import Data
from iveg.domain.recordings import RecordingFile
from iveg.models.base import Hundredth, Model, Stamp, Tenth, members_of


def in_ms(seconds: float | None) -> float | None:
    """Seconds in milliseconds."""
    return None if seconds is None else 1000.0 * seconds


class HopHealth(Model):
    """One hop of the data path from robot to screen.

    Attributes:
        hop: ``mqtt``, ``orion``, ``iot_agent``, ``notifications`` or ``database``.
        state: How it is.
        age_s: Of the evidence (s).
        key: Its sentence.
        detail: What else is known.
        lag_s: How late measures pass it, at least.
    """

    hop: str
    state: Literal["ok", "late", "down", "unknown"]
    age_s: Tenth | None
    key: str
    detail: str
    lag_s: Tenth | None


class Health(Model):
    """State of the data path, and counters.

    Attributes:
        ok: Every hop is.
        hops: One for each hop.
        counters: Events by name.
        earlier: State of the records of earlier runs.
    """

    ok: bool
    hops: list[HopHealth]
    counters: dict[str, int]
    earlier: Literal["known", "reading", "unknown"]


class SegmentSpread(Model):
    """Latency of one hop; null where nothing was measured.

    Attributes:
        count: Messages.
        mean_ms: Mean, exact (ms).
        p50_ms: Quantiles, within 1 % (ms).
        p95_ms: Quantiles, within 1 % (ms).
        p99_ms: Quantiles, within 1 % (ms).
    """

    count: int
    mean_ms: Hundredth | None
    p50_ms: Hundredth | None
    p95_ms: Hundredth | None
    p99_ms: Hundredth | None


class LatencyRow(Model):
    """One kind of data.

    Attributes:
        data: Which.
        hops: By hop: ``uplink``, ``fiware``, ``robot_orion``, ``iveg``, ``screen``.
    """

    data: Data
    hops: dict[str, SegmentSpread]


class LatencyClock(Model):
    """A robot's clock less the server's, as far as it is proven.

    Attributes:
        robot_id: Whose.
        state: ``in_step``, ``assumed``, ``corrected``, ``untrusted``, ``unknown``.
        offset_ms: Robot − server (ms).
        uncertainty_ms: Of the offset (ms).
    """

    robot_id: str
    state: str
    offset_ms: Hundredth | None
    uncertainty_ms: Hundredth | None


class LatencyTable(Model):
    """Every hop of every kind of data over the last 15 minutes.

    Attributes:
        at: When.
        robot: Null: all robots.
        direct: Whether iVeg reads the broker itself, so that Δt₁ and Δt₂ are two
            numbers.
        rows: One for each kind of data.
        paper: The paper's printed numbers, by place, kind of data and column (ms).
        clocks: One for each robot.
        figures: ``cdf`` as Plotly draws it; empty if unwanted.
    """

    at: str
    robot: str | None
    direct: bool
    rows: list[LatencyRow]
    paper: dict[str, dict[str, dict[str, float]]]
    clocks: list[LatencyClock]
    figures: dict[str, object]


@members_of(RecordingFile, "name", "size", "is_open")
class Recording(Model):
    """One file of about an hour.

    A file of about an hour of what came in ([recordings.md](recordings.md)).

    Attributes:
        name: Begins with its first moment (UTC).
        size: Bytes.
        is_open: Still written; it cannot be fetched yet.
        changed_at: When it was written last.
    """

    changed_at: Stamp
