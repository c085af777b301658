"""Report of an experiment: one HTML file that needs no network, conclusions first.

It follows the theme of the reader's browser and needs no script.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Final

from iveg.domain.records import Json
from iveg.lab.experiment import tables
from iveg.lab.experiment.outcome import (
    AGAINST_ITS_TEXT,
    COMPLETION,
    P95_BELOW_MS,
    PRINTED,
    timed_runs,
)
from iveg.lab.experiment.tables import ms, percent, worst_p95

Result = Json


def conclusions(result: Result) -> Iterator[str]:
    """One sentence or two on each question, in English; what was not tried is left out.

    A number stands beside the paper's where the paper has one.
    """
    if result["protected"] is not None:
        yield _protection(result["protected"])
    if runs := len(timed_runs(result)):
        yield _completion(result["completed"]["timed"], runs)
        yield _slow_downs(result["slowdowns"])
    if (farmer := result["detection"]["farmer"])["recall"] is not None:
        yield from _detection(farmer)
    yield from _latency(result)
    yield from _stops(result["stops"])


def _protection(protected: Json) -> str:
    met, never = protected["encounters"], protected["never_slowed"]
    if not met:
        return "Nobody in a camera's view came within 2 m of a moving robot."
    shares = [percent(protected["slowed"][one]) for one in ("in_view", "all")]
    return (
        f"With a person in some camera's view within 2 m, robots drove at no more than "
        f"half speed for {shares[0]} of the time ({shares[1]} with everybody within "
        f"2 m); in {never} of {met} encounters never. Virtual clock, rule as it stands."
    )


def _completion(completed: int, runs: int) -> str:
    paper = f"{COMPLETION['simulation']:.0%} in simulation, {COMPLETION['field']:.0%}"
    return (
        f"{completed} of {runs} runs were completed through all programs; "
        f"the paper: {paper} in the field."
    )


def _slow_downs(slowed: Mapping[str, int]) -> str:
    decided, applied, observed, unseen = (
        slowed.get(one, 0) for one in ("decided", "applied", "observed", "out_of_sight")
    )
    return (
        f"iVeg decided {decided} slow-downs: {applied} were applied by the robot's own "
        f"report, {observed} were seen in its speed, and {unseen} were for somebody "
        f"whom the robot could not see."
    )


def _detection(farmer: Json) -> Iterator[str]:
    if farmer["precision"] is None:
        return
    recall, precision = (
        percent(farmer[one]["share"]) for one in ("recall", "precision")
    )
    simulation, field = (PRINTED[place]["farmer"] for place in ("simulation", "field"))
    yield (
        f"The emulated detector told of {recall} of the farmers in view, and "
        f"{precision} of what it called a farmer was one. The paper: "
        f"{simulation.recall}% and "
        f"{simulation.precision}% in simulation, {field.recall}% and "
        f"{field.precision}% in the field."
    )


def _latency(result: Result) -> Iterator[str]:
    if (worst := worst_p95(result)) is None:
        return
    below = [f"below {P95_BELOW_MS[place]:.0f} ms" for place in ("simulation", "field")]
    yield (
        f"From robot to Orion, 95% of the messages of each kind took no longer than "
        f"{ms(worst)} ms; the paper: {below[0]} in simulation, {below[1]} in the field."
    )
    if result["configuration"].get("fiware") == "embedded":
        yield "All programs ran on one machine: no time is that of a radio link."


def _stops(stops: list[Json]) -> Iterator[str]:
    answers = [one["answer"]["direct"]["p50_ms"] for one in stops]
    stood = [one["standing"]["p50_ms"] for one in stops]
    if not stops or None in (*answers, *stood):
        return
    yield (
        f"After STOP ALL each robot answered within {ms(max(answers))} ms and stood "
        f"still within {ms(max(stood))} ms of the press (medians of each robot)."
    )


EMULATED = (
    "Robots, their cameras and detector, laser, odometry, people and greenhouse are "
    "emulated; the detector makes mistakes at the rates of one of the paper's tables. "
    "The robots' software, MQTT, IoT Agent and Orion (embedded unless another was "
    "named), iVeg and its page are the real programs."
)
COUNTED = (
    "“Here” is counted on a virtual clock: the emulated world, the robots' own safety "
    "machines and all of iVeg between its doors, without programs and sockets, so that "
    "the same seed gives the same counts on any machine. Every picture counts: a "
    "target in view that was told (TP) or not (FN), a box that belongs to none (FP); "
    "boxes match from an overlap of one half at the target's true size, in the robot's "
    "own frame, so that an error of its pose is none of its detector. Brackets are "
    "95 % Wilson intervals, in which two seconds of one robot at one target are worth "
    "one count, as mistakes last so long."
)
TIMED = (
    "All times are of the real programs. Δt₁ robot → broker, Δt₂ broker → Orion's "
    "notification, both by a reader of its own that does nothing else; total = Δt₁ + "
    "Δt₂ of the same messages. Messages of which Orion's copy was read first are in "
    "none of the three; their share is told."
)


PROTECTED = (
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
ENTERED = (
    "How robots reached the ring of 2 m around somebody: foretold so long before, and "
    "at what share of the speed that they wanted. Who stepped out from behind plants "
    "less than two seconds before, and who is in no camera's view, are told apart."
)

_DISAGREES: Final = "Where the paper disagrees with itself"
_Section = tuple[str, str, Sequence[str], Iterable[Sequence[object]]]


def write_report(result: Result) -> str:
    """The whole file."""
    here = files("iveg.lab.experiment")
    style = files("iveg") / "static" / "css" / "tokens.css"
    parts = [
        '<!doctype html><html lang="en" data-theme="auto"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width">',
        f"<title>iVeg experiment</title><style>{style.read_text('utf-8')}",
        f"{(here / 'report.css').read_text('utf-8')}</style></head><body><main>",
        f"<h1>iVeg experiment: {escape(result['plan']['size'])}</h1>",
        *_conclusions(result),
    ]
    for heading, note, head, rows in _sections(result):
        parts += (
            f"<section><h2>{escape(heading)}</h2>",
            note and f"<p>{escape(note)}</p>",
        )
        parts += _table(head, rows), "</section>"
    parts.append(f"<section><h2>{_DISAGREES}</h2>{_list(AGAINST_ITS_TEXT)}</section>")
    return "\n".join([*parts, "</main></body></html>"])


def _sections(result: Result) -> Iterator[_Section]:
    """Heading, note, head and rows of each table."""
    yield "Detection", COUNTED, tables.DETECTION, tables.detection(result)
    yield "What the text says", "", tables.CLAIMS, tables.claims(result)
    yield (
        "Protection",
        PROTECTED,
        tables.PROTECTION,
        tables.protection(result),
    )
    yield (
        "Entries into rings",
        ENTERED,
        tables.ENTRIES,
        tables.entries(result),
    )
    yield "Latency (ms)", TIMED, tables.LATENCY, tables.latency(result)
    stops = tables.stops(result)
    yield "STOP of the fleet (ms since the press)", "", tables.STOPS, stops
    yield "Runs", "", tables.RUNS, tables.runs(result)


def _conclusions(result: Result) -> Iterator[str]:
    """What was found, then by what."""
    yield '<section class="found"><h2>Conclusions</h2>'
    if result["ended_early"]:
        yield f"<p><b>Broken off: {escape(result['ended_early'])}.</b></p>"
    yield f"{_list(conclusions(result))}<p>{escape(EMULATED)}</p></section>"
    yield "<section><h2>What was run</h2>"
    yield f"{_table(('what', 'value'), _facts(result))}</section>"


def _facts(result: Result) -> Iterator[Sequence[object]]:
    plan, machine = result["plan"], result["machine"]
    yield "runs", f"{len(timed_runs(result))} of {result['planned']}"
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


def _table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    cells = "".join(f'<th scope="col">{escape(one)}</th>' for one in head)
    lines = (
        f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>"
        for row in rows
    )
    table = (
        f"<table><thead><tr>{cells}</tr></thead><tbody>{''.join(lines)}</tbody></table>"
    )
    return f'<div class="wide" tabindex="0">{table}</div>'


def _list(sentences: Iterable[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(one)}</li>' for one in sentences)}</ul>"
