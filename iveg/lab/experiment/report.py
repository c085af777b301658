"""The report: one HTML file that needs no network, beside what the paper printed.

It has both languages and all themes of the page: ``?lang=es|en`` and ``?theme=`` choose
one, else the reader's browser does.
"""

from collections.abc import Iterable, Iterator, Sequence
from html import escape
from importlib.resources import files

from iveg.lab.experiment import protection_tables, tables
from iveg.lab.experiment.conclusions import conclusions
from iveg.lab.experiment.paper_tables import AGAINST_ITS_TEXT
from iveg.lab.experiment.report_figures import Result, figures_of, library_script
from iveg.lab.experiment.report_notes import (
    COUNTED,
    EMULATED,
    ENTERED,
    FAILING,
    PROTECTED,
    TIMED,
)
from iveg.lab.experiment.words import SAY, Language, Say

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
        *library_script(result),
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
            parts += figures_of(result, language)
        if head is tables.DISAGREES:
            parts.append(_list(AGAINST_ITS_TEXT, say))
        parts.append("</section>")
    return "\n".join([*parts, "</main>"])


def _sections(result: Result) -> Iterator[_Section]:
    """Heading, note, head and rows of each table."""
    yield "Detection", COUNTED, tables.DETECTION, tables.detection(result)
    yield "Error of place (m)", "", tables.PLACE, tables.place(result)
    yield "What the text says", "", tables.CLAIMS, tables.claims(result)
    yield (
        "Protection",
        PROTECTED,
        protection_tables.PROTECTION,
        protection_tables.protection(result),
    )
    yield (
        "Entries into rings",
        ENTERED,
        protection_tables.ENTRIES,
        protection_tables.entries(result),
    )
    sight = protection_tables.out_of_sight(result)
    yield "Slow-downs, and who was not in sight", "", protection_tables.SIGHT, sight
    yield "Latency (ms)", TIMED, tables.LATENCY, tables.latency(result)
    stops = tables.stops(result)
    yield "STOP of the fleet (ms since the press)", "", tables.STOPS, stops
    disagreeing = tables.disagreeing()
    yield "Where the paper disagrees with itself", "", tables.DISAGREES, disagreeing
    yield "Runs", "", tables.RUNS, tables.runs(result)
    failed = tables.field_tests(result)
    yield "Field tests with failures", FAILING, tables.FIELD_TESTS, failed


def _conclusions(result: Result, say: Say) -> Iterator[str]:
    """What was found, then by what."""
    yield f'<section class="found"><h2>{escape(say("Conclusions"))}</h2>'
    if result["ended_early"]:
        why = escape(result["ended_early"])
        yield f"<p><b>{escape(say('Broken off:'))} {why}.</b></p>"
    yield f"{_list(conclusions(result), say)}<p>{escape(say(EMULATED))}</p></section>"
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
