"""The report: one HTML file that needs no network, beside what the paper printed."""

import gzip
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any

import orjson

from iveg.domain.latency.hops import DATA
from iveg.domain.latency.paper import PAPER
from iveg.experiment.paper_tables import (
    CLASSES,
    COMPLETION_RATE,
    PRINTED,
    disagreements,
)
from iveg.web.pages.charts import library

Result = Mapping[str, Any]
_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em}
table{border-collapse:collapse;margin:1em 0;font-variant-numeric:tabular-nums}
th,td{border:1px solid #999;padding:4px 10px;text-align:right}
th:first-child,td:first-child,td:nth-child(2){text-align:left}
.figure{height:360px}@media print{.figure{break-inside:avoid}}
"""
_EMULATED = (
    "Robots, their cameras and detector, laser, odometry, people and greenhouse are "
    "emulated; the detector makes mistakes at the rates of the paper's field table. "
    "The robots' software, MQTT, IoT Agent and Orion (embedded unless another was "
    "named), iVeg and its page are the real programs."
)
_COUNTED = (
    "Counted are seconds of one robot in which one target was in view (TP found, FN "
    "missed) and seconds in which something was told that is not there (FP); brackets "
    "are 95 % Wilson intervals. Boxes are compared by their centres at the target's "
    "true size; people and noise are seeded, when programs run is not, so that counts "
    "of two runs differ by a few."
)


def write_report(result: Result) -> str:
    """The whole file."""
    parts = [
        f"<h1>iVeg experiment: {result['plan']['size']}</h1>",
        *_head(result),
        "<h2>Detection</h2>",
        f"<p>{_COUNTED}</p>",
        _table(_DETECTION, _detection(result)),
        "<h2>Where the paper's tables disagree with themselves</h2>",
        _table(_DISAGREES, _disagreements()),
        "<h2>Slow-downs, and who was not in sight</h2>",
        *_slowdowns(result),
        "<h2>STOP of the fleet (ms since the press)</h2>",
        _table(("robot", "robot's answer", "standing"), _stops(result)),
        "<h2>Latency (ms)</h2>",
        _table(_LATENCY, _latency(result)),
        *_figures(result),
        "<h2>Runs</h2>",
        _table(("run", "scenario", "seed", "pictures", "completed"), _runs(result)),
    ]
    body = "\n".join(parts)
    head = (
        f'<meta charset="utf-8"><title>iVeg experiment</title><style>{_STYLE}</style>'
    )
    return (
        f'<!doctype html><html lang="en"><head>{head}</head><body>{body}</body></html>'
    )


def _head(result: Result) -> Iterator[str]:
    plan, machine, runs = result["plan"], result["machine"], result["completion"]
    if result["ended_early"]:
        yield f"<p><b>Broken off: {escape(result['ended_early'])}.</b></p>"
    yield (
        f"<p>iVeg {escape(result['version'])}, seed {plan['seed']}, detector "
        f"{escape(plan['profile'])}; {escape(machine['system'])}, {machine['cores']} "
        f"cores, Python {escape(machine['python'])}.</p>"
    )
    yield (
        f"<p>{runs['completed']} of {runs['planned']} runs completed; the paper "
        f"completed {COMPLETION_RATE:.0%} of its own in the field.</p>"
    )
    yield f"<p>{_EMULATED}</p>"


_DETECTION = ("class", "source", "TP", "FP", "FN", "precision", "recall", "AP@0.5")


def _detection(result: Result) -> Iterator[Sequence[object]]:
    for class_id in CLASSES:
        told = result["detection"][class_id]
        rates = (_interval(told["precision"]), _interval(told["recall"]))
        ap = "–" if told["ap"] is None else f"{told['ap']:.2f}"
        counts = (told["tp"], told["fp"], told["fn"])
        yield class_id, "here", *counts, *rates, ap
        for place, rows in PRINTED.items():
            row = rows[class_id]
            rates = (f"{row.precision:.2f} %", f"{row.recall:.2f} %")
            yield class_id, f"paper, {place}", row.tp, row.fp, row.fn, *rates, row.ap


_DISAGREES = ("class", "table", "rate", "printed", "follows from its counts")


def _disagreements() -> Iterator[Sequence[object]]:
    for one in disagreements():
        printed, follows = f"{one.printed:.2f} %", f"{one.follows:.2f} %"
        yield one.class_id, one.place, one.rate, printed, follows


def _slowdowns(result: Result) -> Iterator[str]:
    told, injection = result["slowdowns"], result["injection"]
    if told:
        yield (
            f"<p>{told['decided']} slow-downs were decided, {told['applied']} were "
            f"applied by the robot, {told['observed']} were observed in its speed; "
            f"{told['out_of_sight']} were for somebody whom the robot could not see."
            "</p>"
        )
    if injection:
        yield (
            f"<p>Of {injection['asked']} moments in which another robot had a person "
            f"in view and AGII had not, the person stood in AGII's costmap in "
            f"{injection['injected']}.</p>"
        )


def _stops(result: Result) -> Iterator[Sequence[object]]:
    for one in result["stops"]:
        answered = _ms(one["answer_direct"]["p50_ms"])
        yield one["robot_id"], answered, _ms(one["standing"]["p50_ms"])


_LATENCY = ("data", "source", "n", "Δt₁", "P95", "Δt₂", "P95", "total", "P95")


def _latency(result: Result) -> Iterator[Sequence[object]]:
    rows = {
        one["data"]: one["hops"] for one in result.get("latency", {}).get("rows", [])
    }
    for data in DATA:
        if data in rows:
            hops = [rows[data][hop] for hop in ("uplink", "fiware", "robot_orion")]
            cells = [_ms(hop[name]) for hop in hops for name in ("mean_ms", "p95_ms")]
            yield data, "here", hops[2]["count"], *cells
        for place, printed in PAPER.items():
            row = printed[data]
            cells = [
                _ms(value)
                for value in (
                    row.uplink_mean,
                    row.uplink_p95,
                    row.fiware_mean,
                    row.fiware_p95,
                    row.total_mean,
                    row.total_p95,
                )
            ]
            yield data, f"paper, {place}", "", *cells


def _figures(result: Result) -> Iterator[str]:
    """Plotly's own script lies in the file, so that it opens anywhere."""
    figures = result.get("latency", {}).get("figures", {})
    drawn = {name: one for name, one in figures.items() if one["data"]}
    if not drawn:
        return
    for name in drawn:
        yield f'<div class="figure" id="{name}"></div>'
    script = (
        gzip.decompress(library().packed).decode().replace("</script", "<\\/script")
    )
    yield f"<script>{script}</script>"
    told = orjson.dumps(drawn).decode().replace("</", "<\\/")
    yield (
        f"<script>const figures={told};for(const name in figures)"
        "{const{data,layout}=figures[name];"
        "layout.xaxis={...layout.xaxis,title:{text:layout.meta.x}};"
        "layout.yaxis={...layout.yaxis,title:{text:layout.meta.y}};"
        "Plotly.newPlot(name,data,layout,{displayModeBar:false})}</script>"
    )


def _runs(result: Result) -> Iterator[Sequence[object]]:
    for one in result["runs"]:
        done = "yes" if one["completed"] else "no"
        yield one["number"], one["family"], one["seed"], one["pictures"], done


def _table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    cells = "".join(f"<th>{escape(one)}</th>" for one in head)
    lines = (
        "<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>"
        for row in rows
    )
    return f"<table><tr>{cells}</tr>{''.join(lines)}</table>"


def _interval(told: Mapping[str, float] | None) -> str:
    if told is None:
        return "–"
    share, low, high = (100.0 * told[name] for name in ("share", "low", "high"))
    return f"{share:.1f} % [{low:.1f}, {high:.1f}]"


def _ms(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"
