"""Report of an experiment: one HTML file that needs no network, conclusions first.

It follows the theme of the reader's browser and needs no script; its tables are in
``report.html``, with the paper's numbers.
"""

from collections.abc import Iterator, Mapping
from importlib.resources import files
from typing import Final

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from iveg.domain.latency import PAPER, Place
from iveg.domain.records import Json
from iveg.lab.experiment.outcome import timed_runs

COMPLETION: Final[Mapping[Place, float]] = {"simulation": 0.92, "field": 0.82}
"""Share of its runs that the paper calls completed."""
P95_BELOW_MS: Final[Mapping[Place, float]] = {"simulation": 202.0, "field": 320.0}
"""P95 that the paper states for all data from robot to Orion (ms)."""


def write_report(result: Json) -> str:
    """The whole file."""
    here, css = files("iveg.lab.experiment"), files("iveg") / "static" / "css"
    style = (css / "tokens.css").read_text("utf-8")
    style += (here / "report.css").read_text("utf-8")
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    environment.filters |= {"decimals": _decimals, "percent": _percent}
    template = environment.from_string((here / "report.html").read_text("utf-8"))
    return template.render(
        result=result,
        style=Markup(style),  # noqa: S704 - our own
        conclusions=list(conclusions(result)),
        runs=timed_runs(result),
        latency_of_paper=PAPER,
        completion=COMPLETION,
        p95_below_ms=P95_BELOW_MS,
        worst_p95=_worst_p95(result),
    )


def _decimals(value: float | None, digits: int = 1) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{share:.1%}"


def _worst_p95(result: Json) -> float | None:
    """Greatest P95 of a kind of data from robot to Orion (ms)."""
    hops = [row["hops"]["robot_orion"] for row in result["latency"]]
    return max((hop["p95_ms"] or 0.0 for hop in hops), default=0.0) or None


def conclusions(result: Json) -> Iterator[str]:
    """Sentences on each tested question, in English.

    A number stands beside the paper's where the paper has one.
    """
    by_rule = (row for row in result["protection"] if row["rule"] == "iveg")
    if (protected := next(by_rule, None)) is not None:
        yield _protection(protected)
    if runs := len(timed_runs(result)):
        yield _completion(result["completed"], runs)
    yield from _latency(result)


def _protection(protected: Json) -> str:
    encounters, never = protected["encounters"], protected["never_slowed"]
    if not encounters:
        return "Nobody in a camera's view came within 2 m of a moving robot."
    shares = [_percent(protected["slowed"][sight]) for sight in ("in_view", "all")]
    return (
        f"With a person in some camera's view within 2 m, robots drove at no more than "
        f"half speed for {shares[0]} of the time ({shares[1]} with everybody within "
        f"2 m); in {never} of {encounters} encounters never. "
        "Virtual clock, rule as it stands."
    )


def _completion(completed: int, runs: int) -> str:
    paper = f"{COMPLETION['simulation']:.0%} in simulation, {COMPLETION['field']:.0%}"
    return (
        f"{completed} of {runs} runs were completed through all programs; "
        f"the paper: {paper} in the field."
    )


def _latency(result: Json) -> Iterator[str]:
    if (worst := _worst_p95(result)) is None:
        return
    below = [f"below {P95_BELOW_MS[place]:.0f} ms" for place in ("simulation", "field")]
    yield (
        f"From robot to Orion, 95% of the messages of each kind took no longer than "
        f"{_decimals(worst)} ms; the paper: {below[0]} in simulation, {below[1]} in "
        f"the field."
    )
    yield "All programs ran on one machine: no time is that of a radio link."
