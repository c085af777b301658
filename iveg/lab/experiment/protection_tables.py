"""Tables of the report: people out of sight, and how people were protected."""

from collections.abc import Mapping
from typing import Final

from iveg.lab.experiment.cells import percent, seconds
from iveg.lab.experiment.protection import AHEAD_S, AWAY_M, SIGHTS, SLOW_SHARE
from iveg.lab.experiment.tables import Result, Rows

SIGHT: Final = ("what", "here", "here, real time")


_SLOWDOWNS: Final = {
    "decided": "slow-downs decided",
    "applied": "…applied by the robot, by its own report",
    "observed": "…observed in its speed",
    "out_of_sight": "…for somebody whom the robot could not see",
}


_INJECTION: Final = {
    "asked": "moments in which another saw a person and AGII did not",
    "injected": "…with the person in AGII's costmap",
    "people": "people whom another saw before AGII's own camera did",
    "ahead": "…who stood in AGII's costmap before",
}


def out_of_sight(result: Result) -> Rows:
    """Slow-downs, and people out of AGII's sight that were reported to it."""
    yield from _both(result, "slowdowns", _SLOWDOWNS)
    yield from _both(result, "injection", _INJECTION)


def _both(result: Result, what: str, names: Mapping[str, str]) -> Rows:
    """Counts of both halves of the runs, one row for each key of ``names``."""
    for key, name in names.items():
        yield name, *(half[what].get(key, 0) for half in (result, result["stack"]))


PROTECTION: Final = (
    *("where", "detector", "rule", "in view (s)", "slowed", "behind plants (s)"),
    *("slowed", "unseen (s)", "slowed", "encounters", "never slowed", "delay P50 (s)"),
    *("P95", *(f"needless > {away_m:g} m" for away_m in AWAY_M), "driven (m)"),
)


ENTRIES: Final = (
    *("where", "detector", "rule", "person", "entries"),
    *(f"foretold ≥ {AHEAD_S:g} s", f"at ≤ {SLOW_SHARE:.0%} of the speed"),
)


_ENTERED: Final = {
    "in_view": "in view for 2 s",
    "stepped_out": "stepped into view later",
    "unseen": "in no camera's view",
}


def protection(result: Result) -> Rows:
    """Seconds with a person near a moving robot, encounters, and needless slowing."""
    for one in result["protection"]:
        near = (
            cell
            for sight in SIGHTS
            for cell in (
                f"{one['near_s'][sight]:.1f}",
                percent(one["slowed"][sight]),
            )
        )
        delays = (seconds(one[name]) for name in ("delay_p50_s", "delay_p95_s"))
        yield (
            *(one["where"], one["profile"], one["rule"], *near),
            *(one["encounters"], one["never_slowed"], *delays),
            *map(percent, one["needless"].values()),
            f"{one['driven_m']:.1f}",
        )


def entries(result: Result) -> Rows:
    """How rings around people were entered."""
    for one in result["protection"]:
        for kind, name in _ENTERED.items():
            entered = one["entries"][kind]
            rates = percent(entered["foretold"]), percent(entered["slow"])
            chosen = one["where"], one["profile"], one["rule"]
            yield *chosen, name, entered["count"], *rates
