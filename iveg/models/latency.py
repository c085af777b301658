"""Latency of messages from hop to hop (docs/interfaces/resources.md)."""

from pydantic import Field

from iveg.domain.latency.segments import Data, Segment, Window
from iveg.models.base import Model, Slots


class SegmentSpread(Model):
    """Latency of one hop; null where nothing was measured."""

    count: int
    mean_ms: float | None
    p50_ms: float | None
    p95_ms: float | None
    p99_ms: float | None
    least_ms: float | None
    most_ms: float | None


class SegmentBins(Model):
    """All that was measured of one hop, within 1 %."""

    edges_ms: list[float] = Field(
        description="Upper ends of the bins that are not empty, rising."
    )
    counts: list[int] = Field(description="How many messages fell into each.")
    total_ms: float = Field(description="The sum of all durations, exact.")


class LatencyRow(Model):
    """One kind of data."""

    data: Data
    hops: dict[str, SegmentSpread]
    sampled: list[Segment] = Field(
        description="Hops at which only a part of the messages is measured."
    )
    bins: dict[str, SegmentBins] | None = Field(
        default=None, description="Null unless they were asked for."
    )


class LatencyClock(Model):
    """A robot's clock less the server's, as far as it is proven."""

    robot_id: str
    state: str
    offset_ms: float | None
    uncertainty_ms: float | None
    jumps: int


class SegmentOrder(Model):
    """Order of the messages at a hop since the start."""

    passed: int
    missing: int
    reordered: int
    repeated: int
    skipped: int = Field(
        default=0, description="Of those that passed, not read: newer ones were there."
    )


class LatencyStream(Model):
    """One kind of data of one robot: what really comes, and how."""

    robot_id: str
    data: Data
    heard_hz: float
    agent_hz: float
    orion_hz: float
    kept_back: float | None = Field(
        description="Share (0 to 1) not sent to the agent; null without messages."
    )
    throttled: bool
    orion_first: int
    uplink: SegmentOrder
    fiware: SegmentOrder
    excluded: dict[str, dict[str, int]] = Field(
        description="By hop and reason, what is in no statistics."
    )


class SegmentRemark(Model):
    """A present problem of a hop: key and values of a sentence."""

    key: str
    hop: str
    slots: Slots


class SegmentStep(Model):
    """One hop of one message, since the robot's stamp, or since the broker without."""

    hop: Segment
    from_ms: float
    to_ms: float


class LatencyTrace(Model):
    """One message, hop by hop."""

    robot_id: str
    data: Data
    stamp: str | None
    steps: list[SegmentStep]


class LatencyTable(Model):
    """Every hop of every kind of data over one window."""

    at: str
    window: Window
    window_s: float
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
    pages_within_ms: float | None = Field(
        description="How well pages' clocks are known; null while none has told."
    )
    streams: list[LatencyStream]
    remarks: list[SegmentRemark]
    trace: LatencyTrace | None
    library: str = Field(description="Path of the script that draws the figures.")
    style_ids: list[str]
    figures: dict[str, object] = Field(
        description=(
            "``bars``, ``cdf`` and ``trace`` as Plotly draws them; empty if unwanted."
        )
    )
