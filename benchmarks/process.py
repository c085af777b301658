"""Cost of a process, read from ``/proc``, and numbers laid out as a table."""

import os
import select
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20


@dataclass(frozen=True, slots=True)
class Usage:
    """Processor time of a process since its start (s), and resident memory (MiB)."""

    cpu_s: float
    rss_mib: float

    @classmethod
    def of(cls, pid: int) -> "Usage":
        """Read it now."""
        process = Path(f"/proc/{pid}")
        # The name in brackets may hold spaces; what follows does not.
        fields = (process / "stat").read_text().rpartition(")")[2].split()
        resident = int((process / "statm").read_text().split()[1])
        ticks = int(fields[11]) + int(fields[12])
        return cls(ticks / _TICKS_PER_S, resident * _PAGE_MIB)


def percentile(sorted_values: Sequence[float], share: float) -> float:
    """The value that ``share`` (0 to 1) of the values do not exceed (nearest rank)."""
    return sorted_values[min(len(sorted_values) - 1, int(share * len(sorted_values)))]


def machine() -> str:
    """One line about where this was measured."""
    load = os.getloadavg()[0]
    return f"{os.cpu_count()} cores, load {load:.1f}"


def print_table(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print rows under their heads, numbers to the right."""
    lines = [list(head), *map(list, rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    print(f"\n{title}")
    for line in lines:
        first, *others = zip(line, widths, strict=True)
        cells = [first[0].ljust(first[1]), *(text.rjust(w) for text, w in others)]
        print("  ".join(cells).rstrip())


def pause(seconds: float) -> None:
    """Pace what a benchmark sends; for a process of its own, never for a loop."""
    select.select((), (), (), seconds)
