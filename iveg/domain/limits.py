"""Numbers that safety rests on, each once, with its unit and its source.

The rule, the STOP machine, the software on a robot and the pages read them here.  The
server writes them into each page (``static/js/limits.js``).  Where a setting may change
a number, this is its default.  A number that only one algorithm uses stays there.
"""

from dataclasses import dataclass, field
from typing import TypeVar

_Number = TypeVar("_Number", int, float)


def _limit(value: _Number, unit: str, source: str, says: str) -> _Number:
    """A row of the table."""
    facts = {"unit": unit, "source": source, "says": says}
    row: _Number = field(default=value, metadata=facts)
    return row


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """The table; unit, source and meaning of a row are its metadata."""

    detection_threshold: float = _limit(
        0.80, "share", "paper, Algorithm 2", "least confidence that raises an alert"
    )
    zone_default_m: float = _limit(
        2.0, "m", "paper, Algorithm 3", "zone of a fresh sighting, unless the rule says"
    )
    zone_least_m: float = _limit(
        0.5, "m", "chosen: half a robot's length", "least zone that a rule may ask for"
    )
    zone_most_m: float = _limit(
        6.0, "m", "chosen: seen 2.8 s ago", "widest zone, asked for or grown"
    )
    walking_m_s: float = _limit(
        1.6, "m/s", "ISO 13855", "speed of a walking person, and of a growing zone"
    )
    growth_grace_s: float = _limit(
        0.32, "s", "paper, P95 to the broker", "age up to which a zone keeps its size"
    )
    slow_factor: float = _limit(
        0.5, "share", "paper, Algorithm 3", "speed inside a zone"
    )
    release_beyond_m: float = _limit(
        0.3,
        "m",
        "chosen: noise of poses",
        "distance outside a zone from which its limit may end",
    )
    release_after_s: float = _limit(
        1.0,
        "s",
        "chosen: noise of poses",
        "time out there until its limit ends; also on the robot",
    )

    live_s: float = _limit(1.0, "s", "chosen", "age up to which a robot is LIVE")
    late_s: float = _limit(3.0, "s", "chosen", "age up to which it is LATE, then LOST")
    silence_s: float = _limit(
        1.0, "s", "chosen", "age of a pose, frame or peer that halves a speed"
    )
    pose_slow_s: float = _limit(
        0.2, "s", "Husky 0.25 s", "age of a robot's own pose that halves its speed"
    )
    pose_stand_s: float = _limit(
        0.5, "s", "twist_mux 0.5 s", "age of a robot's own pose that stops it"
    )
    pose_lost_s: float = _limit(
        1.5, "s", "Autoware 1.0 s", "age from which a pose gives no place"
    )
    feedback_slow_s: float = _limit(
        1.0, "s", "Nav2 2.0 s", "age of feedback that halves a robot's speed"
    )
    feedback_stand_s: float = _limit(
        3.0, "s", "Spot 3 s", "age of feedback that stops a robot"
    )
    seen_s: float = _limit(1.0, "s", "chosen", "age up to which a person is seen")
    zone_lasts_s: float = _limit(
        10.0, "s", "chosen", "age up to which a sighting has a zone"
    )
    last_seen_s: float = _limit(
        600.0, "s", "chosen", "age up to which a mark stays on the map"
    )
    glimpsed_s: float = _limit(
        60.0, "s", "chosen", "likewise of a person who was seen for less than 2.5 s"
    )

    round_trip_s: float = _limit(
        0.5, "s", "P95 of both ways", "duration beyond which a contradiction is a doubt"
    )
    doubt_ends_s: float = _limit(
        1.0, "s", "chosen", "time without a contradiction that ends a doubt"
    )

    standing_speed: float = _limit(
        0.02, "m/s, rad/s", "chosen: noise at rest", "speed below which a robot stands"
    )
    standing_moved: float = _limit(
        0.1,
        "m, rad",
        "chosen: noise of poses",
        "change of a pose in a second up to which it stands",
    )
    standing_samples: int = _limit(
        5, "reports", "chosen", "least reports at rest of a standstill"
    )
    standing_for_s: float = _limit(
        1.0, "s", "chosen", "least duration of these reports"
    )
    standing_gap_s: float = _limit(
        0.5, "s", "chosen", "greatest gap between two of them"
    )
    standing_gap_sparse_s: float = _limit(
        0.75, "s", "two reports a second", "the same gap through the agent"
    )
    standing_contradicted_by: int = _limit(
        3, "samples", "chosen", "moving samples in a row that end a standstill"
    )

    least_braking_m_s2: float = _limit(
        0.5, "m/s²", "wet floor, not measured", "least braking that may be counted on"
    )
    braking_extra_s: float = _limit(
        1.5, "s", "standstill and way back", "added to the time that braking takes"
    )
    braking_most_s: float = _limit(
        5.0, "s", "chosen", "longest wait before a robot counts as STILL_MOVING"
    )

    unconfirmed_after_s: float = _limit(
        1.0, "s", "chosen", "time without a robot's word until UNCONFIRMED"
    )
    report_fresh_s: float = _limit(
        1.0, "s", "chosen", "oldest report that a release may rest on"
    )
    report_stale_s: float = _limit(
        1.5, "s", "0.5 s one way", "age of a report that makes a standstill STALE"
    )
    release_within_s: float = _limit(
        2.0, "s", "chosen", "time until an unconfirmed release becomes a STOP"
    )
    joined_unseen_s: float = _limit(
        3.0,
        "s",
        "hold to confirm, and its way",
        "time after a press in which no release is taken",
    )
    most_holds: int = _limit(3, "holds", "chosen", "most holds of iVeg at one robot")

    reaction_s: float = _limit(
        0.79, "s", "sum of P95s", "camera to brakes on the other robot"
    )
    onward_s: float = _limit(
        0.29, "s", "sum of P95s", "the part of it after iVeg knows"
    )
    uncertainty_m: float = _limit(
        0.40, "m", "detection 0.30, pose 0.10", "added to a protective distance"
    )
    person_radius_m: float = _limit(0.30, "m", "chosen", "a person's footprint")
    person_widest_m: float = _limit(
        1.2, "m", "chosen: arms half out", "a wider box of a person is not read whole"
    )
    person_highest_m: float = _limit(
        3.0, "m", "chosen: on a trolley", "the same for a higher box"
    )
    margin_clear_m: float = _limit(1.0, "m", "chosen", "a margin from here on is clear")


LIMITS = SafetyLimits()


def grown_radius(radius_m: float, age_s: float) -> float:
    """Radius of the zone of a sighting that is ``age_s`` old (m).

    It keeps its size for the time of a healthy transit, then grows as fast as a person
    walks, and never shrinks.
    """
    if age_s <= LIMITS.growth_grace_s:
        return radius_m
    walked = LIMITS.walking_m_s * (age_s - LIMITS.growth_grace_s)
    return max(radius_m, min(LIMITS.zone_most_m, radius_m + walked))
