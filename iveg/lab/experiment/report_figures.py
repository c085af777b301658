"""Figures of the report, with Plotly's own script so that they open offline."""

import gzip
from collections.abc import Iterator, Mapping
from typing import Any, Final

import orjson

from iveg.domain.latency.paper import PAPER
from iveg.domain.latency.segments import DATA
from iveg.domain.records import Json
from iveg.lab.experiment.outcome import slices_of
from iveg.lab.experiment.slices import whole
from iveg.lab.experiment.words import SAY, Language, Say
from iveg.web.pages.charts import figure_of
from iveg.web.pages.latency_figures import cdf_figure
from iveg.web.pages.plotly_library import library

Result = Json
_HOPS: Final = {"uplink": "Δt₁", "fiware": "Δt₂", "iveg": "Δt₃"}


def figures_of(result: Result, language: Language) -> Iterator[str]:
    """Places of the figures, and what is drawn there."""
    if not result["latency"]["slices"]:
        return
    say = SAY[language]
    drawn = {
        "bars": orjson.loads(_bars(result)),
        "cdf": orjson.loads(cdf_figure(whole(slices_of(result)))),
    }
    for name, figure in drawn.items():
        for trace in figure["data"]:
            _name(trace, say)
        axes = figure["layout"]["meta"]
        axes.update({axis: say(what) for axis, what in axes.items()})
        text = orjson.dumps(figure).decode().replace("</", "<\\/")
        yield f'<div class="figure" id="{name}-{language}"></div>'
        yield f'<script type="application/json">{text}</script>'


def _name(trace: dict[str, Any], say: Say) -> None:
    """Put words for the names of a trace and of its places."""
    if "meta" in trace:
        data, hop = trace["meta"]["data"], trace["meta"]["hop"]
        trace["name"] = f"{say(data)} {_HOPS[hop]}"
    else:
        trace["x"] = [say(one) for one in trace["x"]]


def library_script(result: Result) -> Iterator[str]:
    """Plotly's own script, so that figures open offline."""
    if result["latency"]["slices"]:
        script = gzip.decompress(library().packed).decode()
        yield "<script>" + script.replace("</script", "<\\/script") + "</script>"


def _bars(result: Result) -> bytes:
    """The paper's figure: mean Δt₁ and Δt₂ stacked, a whisker to the total's P95."""
    rows = {one["data"]: one["hops"] for one in result["latency"]["rows"]}
    names: list[str] = []
    columns: list[tuple[float, float, float]] = []
    for data in DATA:
        hops = [rows[data][hop] for hop in ("uplink", "fiware", "robot_orion")]
        means = [hop["mean_ms"] or 0.0 for hop in hops]
        names.append(f"{data}, here")
        columns.append((means[0], means[1], hops[2]["p95_ms"] or 0.0))
        for place, printed in PAPER.items():
            row = printed[data]
            names.append(f"{data}, paper, {place}")
            columns.append((row.uplink_mean, row.fiware_mean, row.total_p95))
    first, second, worst = zip(*columns, strict=True)
    over = [max(0.0, p - a - b) for a, b, p in columns]
    traces: list[Mapping[str, object]] = [
        {"type": "bar", "name": "Δt₁", "x": names, "y": list(first)},
        {
            "type": "bar",
            "name": "Δt₂",
            "x": names,
            "y": list(second),
            "error_y": {"type": "data", "symmetric": False, "array": over},
            "hovertext": [f"P95 {one:.1f} ms" for one in worst],
        },
    ]
    return figure_of(traces, ("data", "ms"), {"barmode": "stack"})
