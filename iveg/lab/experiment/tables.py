"""Tables of the report: ours beside the paper's, and how people were protected."""

from collections.abc import Iterator, Mapping, Sequence
from statistics import fmean
from typing import Final

from iveg.domain.latency import PAPER, Data, Place
from iveg.domain.records import Json
from iveg.lab.experiment.messages import HOPS
from iveg.lab.experiment.outcome import (
    CLASSES,
    COMPLETION,
    CONFIDENCE,
    GLOBAL,
    MEANS,
    P95_BELOW_MS,
    PRINTED,
    PaperScore,
    timed_runs,
)
from iveg.lab.experiment.protection import AHEAD_S, AWAY_M, SIGHTS, SLOW_SHARE


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


Result = Json
Rows = Iterator[Sequence[object]]

DETECTION: Final = ("class", "source", "TP", "FP", "FN", "precision", "recall", "AP")


def detection(result: Result) -> Rows:
    """Per class, in total and in the mean."""
    for class_id in CLASSES:
        yield _counts(class_id, "here", result["detection"][class_id])
        for place, rows in PRINTED.items():
            yield _printed(class_id, place, rows[class_id])
    yield _counts("total", "here", result["global"])
    for place, row in GLOBAL.items():
        yield _printed("total", place, row)
    yield _means(result)
    for place, (precision, recall, ap) in MEANS.items():
        rates = (f"{precision:.2f} %", f"{recall:.2f} %")
        yield "mean", f"paper, {place}", "", "", "", *rates, ap


def _printed(name: str, place: Place, row: PaperScore) -> Sequence[object]:
    """A row of the paper's table."""
    rates = (f"{row.precision:.2f} %", f"{row.recall:.2f} %")
    ap = "–" if row.ap is None else row.ap
    return name, f"paper, {place}", row.tp, row.fp, row.fn, *rates, ap


def _counts(name: str, source: str, score: Json) -> Sequence[object]:
    ap = "–" if score["ap"] is None else f"{score['ap']:.2f}"
    rates = (interval(score["precision"]), interval(score["recall"]))
    return name, source, score["tp"], score["fp"], score["fn"], *rates, ap


def _means(result: Result) -> Sequence[object]:
    rows = [result["detection"][name] for name in CLASSES]
    cells = []
    for rate in ("precision", "recall"):
        shares = [row[rate]["share"] for row in rows if row[rate] is not None]
        cells.append(f"{100.0 * fmean(shares):.1f} %" if shares else "–")
    areas = [row["ap"] for row in rows if row["ap"] is not None]
    ap = f"{fmean(areas):.2f}" if areas else "–"
    return "mean", "here", "", "", "", *cells, ap


CLAIMS: Final = ("what the text says", "here", "paper, simulation", "paper, field")


def claims(result: Result) -> Rows:
    """Numbers of the paper's text."""
    done, of = result["completed"], len(timed_runs(result))
    here = f"{done['counted']} of {of}"
    through = f"{done['timed']} of {of}"
    shares = [f"{COMPLETION[place]:.0%}" for place in PRINTED]
    yield "runs completed", f"{here}; through all programs {through}", *shares
    confidence = result["global"]["confidence"]
    sure = [f"{CONFIDENCE[place]:.0%}" for place in PRINTED]
    yield "mean confidence", "–" if confidence is None else f"{confidence:.0%}", *sure
    yield "…of these at or above the rule's threshold", _confident(result), "", ""
    sent, lost, reordered = (
        sum(row["messages"].get(name, 0) for row in result["latency"])
        for name in ("sent", "lost", "reordered")
    )
    yield "messages that never came out of Orion", f"{lost} of {sent}", "none", ""
    yield "messages that came out of Orion after a later one", f"{reordered}", "", ""
    below = [f"below {P95_BELOW_MS[place]:.0f} ms" for place in PRINTED]
    worst = worst_p95(result)
    yield "P95 from robot to Orion", "–" if worst is None else f"{worst:.1f} ms", *below


def _confident(result: Result) -> str:
    threshold = result["configuration"].get("confidence_threshold")
    tallies = (one["counted"]["classes"].values() for one in timed_runs(result))
    found = [sure for each in tallies for one in each for sure in one.found]
    if threshold is None or not found:
        return "–"
    return f"{sum(one >= threshold for one in found) / len(found):.0%} ({threshold})"


def worst_p95(result: Result) -> float | None:
    """Greatest P95 of a kind of data from robot to Orion (ms)."""
    hops = [row["hops"]["robot_orion"] for row in result["latency"]]
    return max((one["p95_ms"] or 0.0 for one in hops), default=0.0) or None


STOPS: Final = ("robot", "robot's answer", "standing")


def stops(result: Result) -> Rows:
    """STOP of the fleet (ms since the request)."""
    for one in result["stops"]:
        answered = ms(one["answer"]["direct"]["p50_ms"])
        yield one["robot_id"], answered, ms(one["standing"]["p50_ms"])


LATENCY: Final = (
    *("data", "source", "n", "Δt₁", "P95", "n", "Δt₂", "P95"),
    *("n", "total", "P95", "Orion first"),
)


def latency(result: Result) -> Rows:
    """The paper's table (ms)."""
    for one in result["latency"]:
        data: Data = one["data"]
        up, on, total = (
            (hop["count"], ms(hop["mean_ms"]), ms(hop["p95_ms"]))
            for hop in (one["hops"][name] for name in HOPS)
        )
        yield data, "here", *up, *on, *total, _first(one["messages"])
        for place, printed in PAPER.items():
            row = printed[data]
            yield (
                *(data, f"paper, {place}"),
                *("", ms(row.uplink_mean), ms(row.uplink_p95)),
                *("", ms(row.fiware_mean), ms(row.fiware_p95)),
                *("", ms(row.total_mean), ms(row.total_p95), ""),
            )


def _first(messages: Mapping[str, int]) -> str:
    """Share of the messages that were read at Orion before they were at the broker."""
    came = messages.get("sent", 0) - messages.get("lost", 0)
    return f"{messages['orion_first'] / came:.1%}" if came else "–"


RUNS: Final = (
    *("run", "scenario", "seed", "pictures", "completed"),
    *("completed in real time", "Orion kept up", "load before", "after"),
)


def runs(result: Result) -> Rows:
    """One line per run."""
    for one in timed_runs(result):
        counted, timed = one["counted"], one["timed"]
        ends = counted["completed"], timed["completed"], timed["settled"]
        said = ("yes" if is_so else "no" for is_so in ends)
        chosen = one["number"], one["family"], one["seed"], counted["pictures"]
        yield *chosen, *said, *one["load"]


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
