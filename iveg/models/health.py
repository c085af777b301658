"""Whether the data path from robot to screen is whole, and how soon robots obey.

Safety figures: how soon the fleet obeys.

Latency of messages from hop to hop (docs/interfaces/resources.md).

Recordings of what came in.
"""

from typing import Literal

from pydantic import Field

from iveg.domain.alerts import ECHO_S, WINDOW_S, Acknowledgements
from iveg.domain.latency import Data, Window
from iveg.domain.recordings import RecordingFile
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, rounded


class AlertLatency(Model):
    """From the frame that a slow-down rests on to the robot's own report (ms).

    From the notification of the newest detection frame with the person to the robot's
    own report of the factor, on the server's clock. A robot that judged ahead of iVeg
    is timed by when it said so, from the newest frame that it had been told of. A robot
    that drives into a ring of which nobody has a frame for 0.25 s is not timed.

    Attributes:
        p50_ms: Quantiles (ms).
        p95_ms: Quantiles (ms).
        p99_ms: Quantiles (ms).
        count: Samples.
        window_s: 300 (s).
        age_s: Of the newest sample (s).
    """

    p50_ms: float | None
    p95_ms: float | None
    p99_ms: float | None
    count: int
    window_s: float
    age_s: float | None


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
    within_s: float
    window_s: float
    age_s: float | None


class Safety(Model):
    """Reaction times of the fleet."""

    alert_latency: AlertLatency
    not_echoed: NotAcknowledged

    @classmethod
    def of(cls, acknowledgements: Acknowledgements) -> "Safety":
        """As it stands now."""
        return cls(
            alert_latency=AlertLatency(
                p50_ms=_ms(acknowledgements.p50_s),
                p95_ms=_ms(acknowledgements.p95_s),
                p99_ms=_ms(acknowledgements.p99_s),
                count=acknowledgements.timed,
                window_s=WINDOW_S,
                age_s=rounded(acknowledgements.echo_age_s, 1),
            ),
            not_echoed=NotAcknowledged(
                count=acknowledgements.missed,
                of=acknowledgements.asked,
                within_s=ECHO_S,
                window_s=WINDOW_S,
                age_s=rounded(acknowledgements.asked_age_s, 1),
            ),
        )


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else round(1000.0 * seconds, 1)


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
    age_s: float | None
    key: str
    detail: str
    lag_s: float | None = Field(description="How late measures pass it, at least.")
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
    mean_ms: float | None
    p50_ms: float | None
    p95_ms: float | None
    p99_ms: float | None


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
    offset_ms: float | None
    uncertainty_ms: float | None


class LatencyTable(Model):
    """Every hop of every kind of data over one window.

    Attributes:
        at: When.
        window: The window.
        rows: One for each kind of data.
        clocks: One for each robot.
        style_ids: As of the climate.
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
    library: str = Field(description="Path of the script that draws the figure.")
    style_ids: list[str]
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
    changed_at: str

    @classmethod
    def of(cls, file: RecordingFile) -> "Recording":
        """As it lies on the disk."""
        return cls(
            name=file.name,
            size=file.size,
            is_open=file.is_open,
            changed_at=format_stamp(file.changed),
        )
