"""Rows become Plotly figures; the only importer of plotly.

The package checks every figure as it is made.  The browser draws it with the basic
bundle of the same version, which lies beside the page (docs/decisions, "What each
dependency is for").  ``meta`` names what a trace or an axis shows, and the page puts
the words in the reader's language.
"""

from collections.abc import Mapping, Sequence

from iveg.adapters.history.command_latencies import CommandLatency
from iveg.adapters.history.confidence import CONFIDENCE_BINS, ConfidenceCount
from iveg.domain.transports import TRANSPORTS

Trace = Mapping[str, object]

_BIN = 1.0 / CONFIDENCE_BINS


def confidence_figure(
    counts: Sequence[ConfidenceCount], threshold: float | None
) -> bytes:
    """Detections stacked by class over their confidence, the threshold marked."""
    traces = [
        {
            "type": "bar",
            "name": class_id,
            "meta": {"kind": "class", "class_id": class_id},
            "x": [
                round(c.least + _BIN / 2, 4) for c in counts if c.class_id == class_id
            ],
            "y": [c.count for c in counts if c.class_id == class_id],
            "width": 0.9 * _BIN,
        }
        for class_id in sorted({c.class_id for c in counts})
    ]
    layout: dict[str, object] = {"barmode": "stack", "xaxis": {"range": [0, 1]}}
    if threshold is not None:
        layout["shapes"] = [_mark(threshold, "threshold")]
    return figure_of(traces, ("confidence", "count"), layout)


def what_if_figure(
    values: Sequence[float],
    lines: Mapping[str, Sequence[float]],
    axes: tuple[str, str],
    in_force: float,
) -> bytes:
    """Lines over one parameter of the rule, whose value in force is marked; as JSON."""
    traces = [
        {
            "type": "scatter",
            "mode": "lines+markers",
            "name": name,
            "meta": {"kind": f"what_if_{name}", "is_plain": True},
            "x": list(values),
            "y": [round(one, 2) for one in line],
        }
        for name, line in lines.items()
    ]
    layout = {"yaxis": {"rangemode": "tozero"}, "shapes": [_mark(in_force, "in_force")]}
    return figure_of(traces, axes, layout)


def _mark(value: float, name: str) -> Trace:
    """A line over the whole height."""
    height = {"yref": "paper", "y0": 0, "y1": 1}
    return {"type": "line", "name": name, "x0": value, "x1": value, **height}


def stop_figure(latencies: Sequence[CommandLatency]) -> bytes:
    """Times of each STOP (ms): to each transport's answer, and to standing."""
    kinds: dict[str, list[float | None]] = {
        transport.id: [one.answer_ms.get(transport.id) for one in latencies]
        for transport in TRANSPORTS
    }
    kinds["standstill"] = [one.standstill_ms for one in latencies]
    traces = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": kind,
            "meta": {"kind": kind},
            "x": [milliseconds(one.requested_at) for one in latencies],
            "y": took,
            "text": [one.robot_id for one in latencies],
        }
        for kind, took in kinds.items()
        if any(one is not None for one in took)
    ]
    return figure_of(traces, ("time", "took"), {"yaxis": {"rangemode": "tozero"}})


def figure_of(
    traces: Sequence[Trace], axes: tuple[str, str], layout: Mapping[str, object]
) -> bytes:
    """A figure as JSON; ``axes`` say what they show.

    Checked by the package: a wrong name or value raises here, not in a browser.
    """
    # Half of its users never open a chart, and the package is slow to load.
    from plotly.graph_objects import Figure

    figure = Figure(data=list(traces), layout=dict(layout))
    figure.update_layout(template="none", meta={"x": axes[0], "y": axes[1]})
    if axes[0] == "time":
        figure.update_xaxes(type="date")
    return str(figure.to_json()).encode()


def milliseconds(moment: float) -> float:
    """A moment (Unix s) as the browser counts it."""
    return round(1000.0 * moment, 1)
