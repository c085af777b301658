"""The report: one HTML file that needs no network, beside what the paper printed."""

import gzip
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any

import orjson

from iveg.domain.latency.paper import PAPER
from iveg.domain.latency.segments import DATA
from iveg.lab.experiment import tables
from iveg.lab.experiment.outcome import slices_of
from iveg.lab.experiment.paper_tables import AGAINST_ITS_TEXT
from iveg.lab.experiment.slices import whole
from iveg.web.pages.charts import figure_of, library
from iveg.web.pages.latency_figures import cdf_figure

Result = Mapping[str, Any]
_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em}
table{border-collapse:collapse;margin:1em 0;font-variant-numeric:tabular-nums}
th,td{border:1px solid #999;padding:4px 10px;text-align:right}
th:first-child,td:first-child,td:nth-child(2){text-align:left}
.figure{height:360px}tr,.figure{break-inside:avoid}
@media print{body{max-width:none;font-size:11px}th,td{padding:2px 5px}}
"""
_EMULATED = (
    "Robots, their cameras and detector, laser, odometry, people and greenhouse are "
    "emulated; the detector makes mistakes at the rates of the paper's field table. "
    "The robots' software, MQTT, IoT Agent and Orion (embedded unless another was "
    "named), iVeg and its page are the real programs."
)
_COUNTED = (
    "“Here” is counted on a virtual clock: the emulated world, the robots' own safety "
    "machines and all of iVeg between its doors, without programs and sockets, so that "
    "the same seed gives the same counts on any machine. “Here, real time” is the same "
    "scenario through all programs (MQTT, IoT Agent, Orion, /live), where counts "
    "depend on when programs get the processor. Every picture counts: a target in view "
    "that was told (TP) or not (FN), a box that belongs to none (FP); boxes match from "
    "an overlap of one half at the target's true size, in the robot's own frame, so "
    "that an error of its pose is none of its detector. Brackets are 95 % Wilson "
    "intervals, in which two seconds of one robot at one target are worth one count, "
    "as mistakes last so long."
)
_TIMED = (
    "All times are of the real programs. Δt₁ robot → broker, Δt₂ broker → Orion's "
    "notification, both by a reader of its own that does nothing else; total = Δt₁ + "
    "Δt₂ of the same messages. Messages of which Orion's copy was read first are in "
    "none of the three; their share is told. Δt₃ decision, by iVeg's own account, of "
    "all that it read; no page was open, so that Δt₄ is not told."
)


_PROTECTED = (
    "Was anybody near a moving robot unprotected? Seconds are of a person within 2 m "
    "of a robot that moves, and the share of them in which it was limited to half "
    "speed: people in view of some camera, people behind plants (as the robot that is "
    "near sees them), and people who are neither. An encounter is one robot near one "
    "person in view; its delay counts from in view and near. Needless: limited with "
    "nobody within so many metres, of the driving time. “Scenarios” are the runs of "
    "this experiment; the others, with two robots among four people at work, differ "
    "in detector and rule alone: “iveg” as it stands, “paper” Algorithm 2 alone "
    "(single boxes, no laser, no foresight)."
)
_ENTERED = (
    "How robots reached the ring of 2 m around somebody: foretold so long before, and "
    "at what share of the speed that they wanted. Who stepped out from behind plants "
    "less than two seconds before, and who is in no camera's view, are told apart. In "
    "real time nobody notes what was foretold."
)


_FAILING = (
    "The test without a line of sight on the plan of AgroConnect, on the virtual "
    "clock. Navigation gives up and links have gaps at rates that are set by us; who "
    "is missed near a robot is measured. A run fails by navigation, by a robot that "
    "iVeg did not hear for five seconds or at the end (link), by touching somebody, or "
    "by an encounter in which a robot was never slowed (missed)."
)


def write_report(result: Result) -> str:
    """The whole file."""
    parts = [
        f"<h1>iVeg experiment: {escape(result['plan']['size'])}</h1>",
        *_head(result),
        "<h2>Detection</h2>",
        f"<p>{_COUNTED}</p>",
        _table(tables.DETECTION, tables.detection(result)),
        "<h2>Error of place (m)</h2>",
        _table(tables.PLACE, tables.place(result)),
        "<h2>What the text says</h2>",
        _table(tables.CLAIMS, tables.claims(result)),
        "<h2>Protection</h2>",
        f"<p>{_PROTECTED}</p>",
        _table(tables.PROTECTION, tables.protection(result)),
        f"<p>{_ENTERED}</p>",
        _table(tables.ENTRIES, tables.entries(result)),
        "<h2>Slow-downs, and who was not in sight</h2>",
        _table(tables.SIGHT, tables.out_of_sight(result)),
        "<h2>Latency (ms)</h2>",
        f"<p>{_TIMED}</p>",
        _table(tables.LATENCY, tables.latency(result)),
        *_figures(result),
        "<h2>STOP of the fleet (ms since the press)</h2>",
        _table(tables.STOPS, tables.stops(result)),
        "<h2>Where the paper disagrees with itself</h2>",
        _table(tables.DISAGREES, tables.disagreeing()),
        "<ul>"
        + "".join(f"<li>{escape(one)}</li>" for one in AGAINST_ITS_TEXT)
        + "</ul>",
        "<h2>Runs</h2>",
        _table(tables.RUNS, tables.runs(result)),
        "<h2>Field tests with failures</h2>",
        f"<p>{_FAILING}</p>",
        _table(tables.FIELD_TESTS, tables.field_tests(result)),
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
        f"cores, Python {escape(machine['python'])}; {runs['runs']} of "
        f"{runs['planned']} runs, each {plan['counted_s']:g} s on the virtual clock "
        f"and {plan['seconds']:g} s in real time.</p>"
    )
    if result["protected"] is not None:
        yield f"<p><b>{escape(_said(result['protected']))}</b></p>"
    chosen = ", ".join(f"{k} {v}" for k, v in result["configuration"].items())
    yield f"<p>Configuration: {escape(chosen)}.</p>"
    yield f"<p>{_EMULATED}</p>"


def _said(protected: Mapping[str, Any]) -> str:
    """Protection in a sentence."""
    met, never = protected["encounters"], protected["never_slowed"]
    if not met:
        return "Nobody in a camera's view came within 2 m of a moving robot."
    shares = [tables.percent(protected["slowed"][one]) for one in ("in_view", "all")]
    return (
        f"With a person in some camera's view within 2 m, robots drove at no more than "
        f"half speed for {shares[0]} of the time ({shares[1]} with everybody within "
        f"2 m); in {never} of {met} encounters never. Virtual clock, rule as it stands."
    )


# --- figures --------------------------------------------------------------------------


def _figures(result: Result) -> Iterator[str]:
    """Figures; the file contains Plotly's own script, so that it opens offline."""
    if not result["latency"]["slices"]:
        return
    drawn = {
        "bars": orjson.Fragment(_bars(result)),
        "cdf": orjson.Fragment(cdf_figure(whole(slices_of(result)))),
    }
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


def _table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    cells = "".join(f"<th>{escape(one)}</th>" for one in head)
    lines = (
        "<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>"
        for row in rows
    )
    return f"<table><tr>{cells}</tr>{''.join(lines)}</table>"
