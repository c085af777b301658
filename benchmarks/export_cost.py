"""Time and memory of ``iveg export``, which must not grow with its rows.

    python -m benchmarks.export_cost --rows 100000,1000000

Rows are of odometry, in a history of its own; each form is exported by a process, whose
greatest resident memory is told beside the time.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from sqlalchemy import create_engine, text

from benchmarks.process import machine, print_table
from iveg.adapters.history.engine import sqlite_url
from iveg.adapters.history.migrate import upgrade
from tests.processes import ROOT

FORMS = ("csv", "ndjson", "parquet")
_ROWS = """
WITH RECURSIVE numbers (n) AS (
  SELECT 0 UNION ALL SELECT n + 1 FROM numbers WHERE n < :count - 1
)
INSERT INTO odometry (at, robot_id, x, y, yaw, linear, angular, limit_factor,
  applied_factor, link)
SELECT 1.7e9 + n / 20.0, printf('R%02d', n % 10), n % 977 / 100.0, n % 991 / 100.0,
  n % 314 / 100.0, 0.5, 0.0, 1.0, 1.0, 'LIVE' FROM numbers
"""


def main() -> None:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", default="100000,1000000")
    parser.add_argument("--forms", default=",".join(FORMS))
    asked = parser.parse_args()
    cells = []
    for count in map(int, asked.rows.split(",")):
        with tempfile.TemporaryDirectory() as name:
            _fill(Path(name), count)
            for form in asked.forms.split(","):
                took_s, rss_mib, size = _export(Path(name), form)
                told = f"{took_s:.1f}", f"{rss_mib:.0f}", f"{size / 1e6:.1f}"
                cells.append([form, f"{count:,}", *told])
    head = ("form", "rows", "s", "RSS MiB", "file MB")
    print_table(f"iveg export odometry; {machine()}", head, cells)


def _fill(folder: Path, count: int) -> None:
    url = sqlite_url(folder / "iveg.sqlite")
    upgrade(url)
    engine = create_engine(url)
    with engine.begin() as connection:
        connection.execute(text(_ROWS), {"count": count})
    engine.dispose()


def _export(folder: Path, form: str) -> tuple[float, float, int]:
    """Seconds, the greatest resident memory (MiB), and bytes of the file."""
    file = folder / f"odometry.{form}"
    words = ["export", "odometry", "--format", form, "--out", str(file)]
    environment = {**os.environ, "IVEG_DATA_DIRECTORY": str(folder)}
    began = time.monotonic()
    process = subprocess.Popen(
        [sys.executable, "-m", "iveg", *words], cwd=ROOT, env=environment
    )
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(process.returncode)
    return time.monotonic() - began, usage.ru_maxrss / 1024, file.stat().st_size


if __name__ == "__main__":
    main()
