"""The paper's latency figure, live: stacked means with P95 whiskers, CDFs, a waterfall.

Traces name what they show in ``meta``; the page gives them words and colours.
"""

from collections.abc import Iterator, Mapping
from typing import Final

from iveg.domain.latency.account import Cell
from iveg.domain.latency.segments import DATA, Segment
from iveg.domain.latency.sketch import Sketch
from iveg.domain.latency.trace import Trace
from iveg.models.latency import LatencyTrace, SegmentStep
from iveg.web.pages.charts import figure_of

STEPS: Final[tuple[Segment, ...]] = ("uplink", "fiware", "iveg", "screen")
_Trace = Mapping[str, object]
_MOST_POINTS = 200


def bars_figure(sketches: Mapping[Cell, Sketch]) -> bytes:
    """Mean of each hop (ms), stacked by kind of data, with a whisker to its P95."""
    traces = [trace for hop in STEPS for trace in _bars(sketches, hop)]
    return figure_of(traces, ("data", "ms"), {"barmode": "stack"})


def cdf_figure(sketches: Mapping[Cell, Sketch]) -> bytes:
    """Which share of the messages took no longer than so many ms."""
    traces = [
        _curve(data, hop, sketches[data, hop])
        for data in DATA
        for hop in STEPS
        if sketches[data, hop].count
    ]
    layout = {"xaxis": {"type": "log"}, "yaxis": {"range": [0, 1]}}
    return figure_of(traces, ("ms", "share"), layout)


def trace_figure(trace: LatencyTrace | None) -> bytes:
    """One message from hop to hop, each bar from when to when (ms)."""
    bars = [
        {
            "type": "bar",
            "orientation": "h",
            "name": step.hop,
            "meta": {"hop": step.hop},
            "y": [step.hop],
            "base": [step.from_ms],
            "x": [step.to_ms - step.from_ms],
        }
        for step in (trace.steps if trace else ())
    ]
    return figure_of(bars, ("ms", "hop"), {"showlegend": False})


def steps_of(trace: Trace) -> list[SegmentStep]:
    """The hops that a message has passed, in their order.

    The decision may come before Orion's copy: iVeg acts on whichever copy is first.
    """
    start = trace.heard_at - (trace.uplink_s or 0.0)
    spans: list[tuple[Segment, float, float | None]] = [
        ("uplink", start, None if trace.uplink_s is None else trace.heard_at),
        ("fiware", trace.heard_at, trace.notified_at),
        ("iveg", trace.heard_at, trace.decided_at),
        ("screen", trace.decided_at or 0.0, trace.painted_at),
    ]
    return [
        SegmentStep(
            hop=hop,
            from_ms=round(1000.0 * (begin - start), 2),
            to_ms=round(1000.0 * (end - start), 2),
        )
        for hop, begin, end in spans
        if end is not None
    ]


def _bars(sketches: Mapping[Cell, Sketch], hop: Segment) -> Iterator[_Trace]:
    found = {data: sketches[data, hop] for data in DATA}
    measured = {data: one for data, one in found.items() if one.mean is not None}
    if not measured:
        return
    means = {data: 1000.0 * (one.mean or 0.0) for data, one in measured.items()}
    yield {
        "type": "bar",
        "name": hop,
        "meta": {"hop": hop},
        "x": list(measured),
        "y": [round(mean, 3) for mean in means.values()],
        "error_y": {
            "type": "data",
            "symmetric": False,
            "array": [
                round(max(0.0, 1000.0 * (one.quantile(0.95) or 0.0) - means[data]), 3)
                for data, one in measured.items()
            ],
            "arrayminus": [0.0] * len(measured),
        },
    }


def _curve(data: str, hop: str, sketch: Sketch) -> _Trace:
    edges, shares = sketch.distribution()
    every = max(1, len(edges) // _MOST_POINTS)
    kept = [*range(0, len(edges) - 1, every), len(edges) - 1]
    return {
        "type": "scatter",
        "mode": "lines",
        "name": f"{data} {hop}",
        "meta": {"hop": hop, "data": data},
        "x": [round(max(0.01, 1000.0 * edges[place]), 3) for place in kept],
        "y": [round(shares[place], 4) for place in kept],
        "line": {"shape": "hv"},
    }
