"""Safety figures: how soon the fleet obeys, and how near it comes to people."""

from iveg.domain.acknowledgements import ECHO_S, WINDOW_S, Acknowledgements
from iveg.domain.exposure import Exposure
from iveg.domain.observations import Instant
from iveg.models.base import Model, moment, rounded
from iveg.models.margin import Margin


class AlertLatency(Model):
    """From the frame that a slow-down rests on to the robot's own report (ms)."""

    p50_ms: float | None
    p95_ms: float | None
    p99_ms: float | None
    count: int
    window_s: float
    age_s: float | None


class NotAcknowledged(Model):
    """Alerts that a robot did not answer in time, of those that it should have."""

    count: int
    of: int
    within_s: float
    window_s: float
    age_s: float | None


class NegativeMargin(Model):
    """Share of today's known time with a margin below zero (0 to 1)."""

    share: float | None
    known_s: float
    unknown_s: float
    count: int
    since: str | None
    age_s: float | None


class WorstMargin(Model):
    """The least margin of today, when it was, and of how many looks."""

    margin: Margin | None
    at: str | None
    count: int
    since: str | None
    age_s: float | None


class Safety(Model):
    """Reaction times of the fleet and its margins to people; never "safe"."""

    alert_latency: AlertLatency
    not_echoed: NotAcknowledged
    negative_margin: NegativeMargin
    worst_margin: WorstMargin

    @classmethod
    def of(
        cls, acknowledgements: Acknowledgements, exposure: Exposure | None, now: Instant
    ) -> "Safety":
        """As it stands now; ``exposure`` None: nobody has looked today."""
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
            negative_margin=_negative(exposure, now),
            worst_margin=_worst(exposure, now),
        )


def _negative(exposure: Exposure | None, now: Instant) -> NegativeMargin:
    day = exposure or Exposure(now, now)
    return NegativeMargin(
        share=rounded(day.share, 5),
        known_s=round(day.known_s, 1),
        unknown_s=round(day.unknown_s, 1),
        count=day.evaluations,
        since=None if exposure is None else moment(day.since),
        age_s=_looked_s(exposure, now),
    )


def _worst(exposure: Exposure | None, now: Instant) -> WorstMargin:
    worst = None if exposure is None else exposure.worst
    return WorstMargin(
        margin=None if worst is None else Margin.of(worst.margin),
        at=None if worst is None else moment(worst.at),
        count=0 if exposure is None else exposure.evaluations,
        since=None if exposure is None else moment(exposure.since),
        age_s=_looked_s(exposure, now),
    )


def _looked_s(exposure: Exposure | None, now: Instant) -> float | None:
    return None if exposure is None else round(now.mono - exposure.evaluated_at.mono, 1)


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else round(1000.0 * seconds, 1)
