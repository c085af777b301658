"""The report: one HTML file that needs no network, beside what the paper printed.

It has both languages and all themes of the page: ``?lang=es|en`` and ``?theme=`` choose
one, else the reader's browser does.
"""

import gzip
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any, Final

import orjson

from iveg.domain.latency.paper import PAPER
from iveg.domain.latency.segments import DATA
from iveg.domain.records import Json
from iveg.lab.experiment import protection_tables, tables
from iveg.lab.experiment.conclusions import conclusions
from iveg.lab.experiment.outcome import slices_of
from iveg.lab.experiment.paper_tables import AGAINST_ITS_TEXT
from iveg.lab.experiment.slices import whole
from iveg.lab.experiment.words import SAY, Language, Say
from iveg.web.pages.charts import figure_of, library
from iveg.web.pages.latency_figures import cdf_figure

Result = Json
_EMULATED = (
    "Robots, their cameras and detector, laser, odometry, people and greenhouse are "
    "emulated; the detector makes mistakes at the rates of one of the paper's tables. "
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


_HOPS: Final = {"uplink": "Δt₁", "fiware": "Δt₂", "iveg": "Δt₃"}
_Section = tuple[str, str, Sequence[str], Iterable[Sequence[object]]]


def write_report(result: Result) -> str:
    """The whole file."""
    here = files("iveg.lab.experiment")
    style = files("iveg") / "static" / "css" / "tokens.css"
    parts = [
        '<!doctype html><html lang="en" data-theme="auto"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width">',
        f"<title>iVeg experiment</title><style>{style.read_text('utf-8')}",
        f"{(here / 'report.css').read_text('utf-8')}</style>",
        '</head><body><nav><button type="button" lang="en">English</button>',
        '<button type="button" lang="es">Español</button></nav>',
        *(_in_language(result, language) for language in SAY),
        *_library(result),
        f"<script>{(here / 'report.js').read_text('utf-8')}</script></body></html>",
    ]
    return "\n".join(parts)


def _in_language(result: Result, language: Language) -> str:
    say = SAY[language]
    title = escape(say("iVeg experiment:")), escape(result["plan"]["size"])
    parts = [
        f'<main lang="{language}"><h1>{" ".join(title)}</h1>',
        *_conclusions(result, say),
    ]
    for heading, note, head, rows in _sections(result):
        parts.append(f"<section><h2>{escape(say(heading))}</h2>")
        if note:
            parts.append(f"<p>{escape(say(note))}</p>")
        parts.append(_table(head, rows, say))
        if head is tables.LATENCY:
            parts += _figures(result, language)
        if head is tables.DISAGREES:
            parts.append(_list(AGAINST_ITS_TEXT, say))
        parts.append("</section>")
    return "\n".join([*parts, "</main>"])


def _sections(result: Result) -> Iterator[_Section]:
    """Heading, note, head and rows of each table."""
    yield "Detection", _COUNTED, tables.DETECTION, tables.detection(result)
    yield "Error of place (m)", "", tables.PLACE, tables.place(result)
    yield "What the text says", "", tables.CLAIMS, tables.claims(result)
    yield (
        "Protection",
        _PROTECTED,
        protection_tables.PROTECTION,
        protection_tables.protection(result),
    )
    yield (
        "Entries into rings",
        _ENTERED,
        protection_tables.ENTRIES,
        protection_tables.entries(result),
    )
    sight = protection_tables.out_of_sight(result)
    yield "Slow-downs, and who was not in sight", "", protection_tables.SIGHT, sight
    yield "Latency (ms)", _TIMED, tables.LATENCY, tables.latency(result)
    stops = tables.stops(result)
    yield "STOP of the fleet (ms since the press)", "", tables.STOPS, stops
    disagreeing = tables.disagreeing()
    yield "Where the paper disagrees with itself", "", tables.DISAGREES, disagreeing
    yield "Runs", "", tables.RUNS, tables.runs(result)
    failed = tables.field_tests(result)
    yield "Field tests with failures", _FAILING, tables.FIELD_TESTS, failed


def _conclusions(result: Result, say: Say) -> Iterator[str]:
    """What was found, then by what."""
    yield f'<section class="found"><h2>{escape(say("Conclusions"))}</h2>'
    if result["ended_early"]:
        why = escape(result["ended_early"])
        yield f"<p><b>{escape(say('Broken off:'))} {why}.</b></p>"
    yield f"{_list(conclusions(result), say)}<p>{escape(say(_EMULATED))}</p></section>"
    yield f"<section><h2>{escape(say('What was run'))}</h2>"
    yield f"{_table(('what', 'value'), _facts(result), say)}</section>"


def _facts(result: Result) -> Iterator[Sequence[object]]:
    plan, machine, runs = result["plan"], result["machine"], result["completion"]
    yield "runs", f"{runs['runs']} of {runs['planned']}"
    yield "each on the virtual clock", f"{plan['counted_s']:g} s"
    yield "each in real time", f"{plan['seconds']:g} s"
    yield "seed", plan["seed"]
    yield "rates of the detector's mistakes", plan["profile"]
    yield (
        "configuration",
        ", ".join(f"{k} {v}" for k, v in result["configuration"].items()),
    )
    yield "machine", f"{machine['system']}, {machine['cores']} cores"
    yield "programs", f"iVeg {result['version']}, Python {machine['python']}"


# --- figures --------------------------------------------------------------------------


def _figures(result: Result, language: Language) -> Iterator[str]:
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


def _library(result: Result) -> Iterator[str]:
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


def _table(head: Sequence[str], rows: Iterable[Sequence[object]], say: Say) -> str:
    cells = "".join(f'<th scope="col">{escape(say(one))}</th>' for one in head)
    lines = (
        f"<tr>{''.join(f'<td>{escape(say(str(cell)))}</td>' for cell in row)}</tr>"
        for row in rows
    )
    table = (
        f"<table><thead><tr>{cells}</tr></thead><tbody>{''.join(lines)}</tbody></table>"
    )
    return f'<div class="wide" tabindex="0">{table}</div>'


def _list(sentences: Iterable[str], say: Say) -> str:
    return f"<ul>{''.join(f'<li>{escape(say(one))}</li>' for one in sentences)}</ul>"
