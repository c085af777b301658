"""Evaluation of the findings of ``iveg doctor``: rows, sentences, exit code; no I/O.

A hop is tested only when the hops it depends on are well, so that one broken part is
one failed row and not six.  The order is the order of the examination.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from iveg.cli.advice import advise
from iveg.cli.findings import Findings, Lag, Stack
from iveg.domain.hops import NEEDS, Check, Hop
from iveg.domain.probe import SLOW_S

State = Literal["ok", "failed", "not tried"]


@dataclass(frozen=True, slots=True)
class DiagnosisRow:
    """One line of the table; ``sentence`` is empty for a hop that works."""

    check: Check
    state: State
    took_s: float | None = None
    sentence: str = ""


def missing(check: Check, findings: Findings) -> tuple[Check, ...]:
    """The hops that a hop depends on and that do not work."""
    return tuple(
        need for need in NEEDS[check] if need not in findings or not findings[need].well
    )


def judge(findings: Findings, stack: Stack) -> list[DiagnosisRow]:
    """Every hop with its state and, where it failed, advice."""
    return [_row(check, findings, stack) for check in Check]


def exit_code(rows: Sequence[DiagnosisRow]) -> int:
    """0 if every hop works, else 1."""
    return int(any(row.state != "ok" for row in rows))


def table(rows: Sequence[DiagnosisRow]) -> str:
    """The rows as text: hop, state, milliseconds, and sentences below their row."""
    wide = max(len(check) for check in Check)
    lines = [f"{'hop':<{wide}}  {'state':<9}  {'ms':>6}"]
    for row in rows:
        took = "" if row.took_s is None else f"{row.took_s * 1000:.0f}"
        lines.append(f"{row.check:<{wide}}  {row.state:<9}  {took:>6}".rstrip())
        if row.sentence:
            lines.append(f"    {row.sentence}")
    return "\n".join(lines)


def _row(check: Check, findings: Findings, stack: Stack) -> DiagnosisRow:
    finding = findings.get(check)
    if finding is None:
        return DiagnosisRow(check, "not tried", None, _why_not(check, findings, stack))
    if finding.trouble is None:
        late = check == Check.MEASURE and finding.took_s > SLOW_S
        sentence = f"{Lag(finding.took_s).sentence}." if late else ""
        return DiagnosisRow(check, "ok", finding.took_s, sentence)
    return DiagnosisRow(
        check, "failed", finding.took_s, advise(finding, findings, stack)
    )


def _why_not(check: Check, findings: Findings, stack: Stack) -> str:
    if stack.lag is not None and check.hop is Hop.AGENT:
        return "The agent is behind: nothing is added."
    because = " and ".join(f"“{need}”" for need in missing(check, findings))
    return f"Stands on {because}." if because else ""
