"""Health of the data path, latency hop by hop, and recordings."""

from typing import Literal, Self

from pydantic import Field

from iveg.domain.latency import Data
from iveg.domain.recordings import RecordingFile
from iveg.models.base import Hundredth, Model, Stamp, Tenth


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
    """

    hop: str
    state: Literal["ok", "late", "down", "unknown"]
    age_s: Tenth | None
    key: str
    detail: str
    lag_s: Tenth | None = Field(description="How late measures pass it, at least.")


class Health(Model):
    """State of the data path, and counters.

    Attributes:
        ok: Every hop is.
        hops: One for each hop.
        counters: Events by name.
    """

    ok: bool
    hops: list[HopHealth]
    counters: dict[str, int]
    earlier: Literal["known", "reading", "unknown"] = Field(
        description="State of the records of earlier runs."
    )


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
        rows: One for each kind of data.
        clocks: One for each robot.
    """

    at: str
    robot: str | None = Field(description="Null: all robots.")
    direct: bool = Field(
        description=(
            "Whether iVeg reads the broker itself, so that Δt₁ and Δt₂ are two numbers."
        )
    )
    rows: list[LatencyRow]
    paper: dict[str, dict[str, dict[str, float]]] = Field(
        description=(
            "The paper's printed numbers, by place, kind of data and column (ms)."
        )
    )
    clocks: list[LatencyClock]
    figures: dict[str, object] = Field(
        description="``cdf`` as Plotly draws it; empty if unwanted."
    )


class Recording(Model):
    """One file of about an hour.

    A file of about an hour of what came in ([recordings.md](recordings.md)).

    Attributes:
        changed_at: When it was written last.
    """

    name: str = Field(description="Begins with its first moment (UTC).")
    size: int = Field(description="Bytes.")
    is_open: bool = Field(description="Still written; it cannot be fetched yet.")
    changed_at: Stamp

    @classmethod
    def of(cls, file: RecordingFile) -> Self:
        """As it lies on the disk."""
        return cls.from_value(file, changed_at=file.changed)
