"""Health of the data path, latency hop by hop, recordings; how soon robots obey."""

from typing import Literal, Self

from pydantic import Field

from iveg.domain.alerts import ECHO_S, WINDOW_S, Acknowledgements
from iveg.domain.latency import Data, Window
from iveg.domain.recordings import RecordingFile
from iveg.models.base import Hundredth, Model, Stamp, Tenth


class AlertLatency(Model):
    """From the frame that a slow-down rests on to the robot's own report (ms).

    From the notification of the newest detection frame with the person to the robot's
    own report of the factor, on the server's clock. A robot that judged ahead of iVeg
    is timed by when it said so, from the newest frame that it had been told of. A robot
    that drives into a zone of which nobody has a frame for 0.25 s is not timed.

    Attributes:
        p50_ms: Quantiles (ms).
        p95_ms: Quantiles (ms).
        p99_ms: Quantiles (ms).
        count: Samples.
        window_s: 300 (s).
        age_s: Of the newest sample (s).
    """

    p50_ms: Tenth | None
    p95_ms: Tenth | None
    p99_ms: Tenth | None
    count: int
    window_s: float = WINDOW_S
    age_s: Tenth | None


class NotAcknowledged(Model):
    """Alerts that a robot did not answer in time, of those that it should have.

    Alerts that a robot did not acknowledge in time. A robot that was slow for something
    else is not asked; one that had judged the alert itself has answered.

    Attributes:
        count: Not acknowledged.
        of: Asked.
        within_s: 1.0 (s).
        window_s: 300 (s).
        age_s: Of the newest (s).
    """

    count: int
    of: int
    within_s: float = ECHO_S
    window_s: float = WINDOW_S
    age_s: Tenth | None


class Safety(Model):
    """Reaction times of the fleet."""

    alert_latency: AlertLatency
    not_echoed: NotAcknowledged

    @classmethod
    def of(cls, acknowledgements: Acknowledgements) -> Self:
        """As it stands now."""
        latency = AlertLatency(
            p50_ms=in_ms(acknowledgements.p50_s),
            p95_ms=in_ms(acknowledgements.p95_s),
            p99_ms=in_ms(acknowledgements.p99_s),
            count=acknowledgements.timed,
            age_s=acknowledgements.echo_age_s,
        )
        missed = NotAcknowledged(
            count=acknowledgements.missed,
            of=acknowledgements.asked,
            age_s=acknowledgements.asked_age_s,
        )
        return cls(alert_latency=latency, not_echoed=missed)


def in_ms(seconds: float | None) -> float | None:
    """Seconds in milliseconds."""
    return None if seconds is None else 1000.0 * seconds


class HopHealth(Model):
    """One hop of the data path from robot to screen.

    Attributes:
        hop: ``mqtt``, ``orion``, ``iot_agent``, ``notifications``, ``database`` or
            ``emulator``.
        state: How it is.
        age_s: Of the evidence (s).
        key: Its sentence.
        detail: What else is known.
        growing: The lag grows.
    """

    hop: str
    state: Literal["ok", "late", "down", "unknown"]
    age_s: Tenth | None
    key: str
    detail: str
    lag_s: Tenth | None = Field(description="How late measures pass it, at least.")
    growing: bool


class Health(Model):
    """State of the data path, counters, and reaction times of the fleet.

    Attributes:
        ok: Every hop is.
        hops: One for each hop.
        counters: Events by name.
        safety: How soon the fleet obeys.
    """

    ok: bool
    hops: list[HopHealth]
    counters: dict[str, int]
    safety: Safety
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
    """Every hop of every kind of data over one window.

    Attributes:
        at: When.
        window: The window.
        rows: One for each kind of data.
        clocks: One for each robot.
    """

    at: str
    window: Window
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
