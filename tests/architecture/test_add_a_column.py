"""A column of the history is one line: added in a copy, it is wherever it has to be."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.processes import ROOT

pytestmark = pytest.mark.slow

RECORDS = "iveg/domain/records.py"
# Record → the line that is added before its line of this name.
LINES = {
    "DecisionRecord": (
        "    speed_before: ",
        '    slope: Annotated[float | None, Means("Of the ground.", "rad")] = None\n',
    ),
    "MeasurementRecord": (
        "    unit: ",
        '    checked_at: Annotated[float | None, _time("Checked.")] = None\n',
    ),
}
MIGRATION = '''"""Keep two columns more."""

import sqlalchemy as sa
from alembic import op

revision = "more"
down_revision = "half"


def upgrade() -> None:
    op.add_column("decisions", sa.Column("slope", sa.Double()))
    op.add_column("measurements", sa.Column("checked_at", sa.Double()))
'''
ASKS = """
import asyncio, json
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from iveg.adapters.history import lists
from iveg.adapters.history.lists import Filter
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Store
from iveg.adapters.history.tables import EARLIER, metadata
from iveg.domain.records import DecisionRecord, MeasurementRecord
from iveg.models.dictionary import describe
from iveg.models.docs import write_page
from iveg.models.history import Decision, Measurement
from iveg.models.typescript import write_types
from iveg.vital.record import Waiting
from iveg.web.api.exports import csv_lines, ndjson_rows

decision = DecisionRecord(
    decision_id="D", kind="alert", robot_id="AGI", started_at=1.0, slope=0.25
)
measurement = MeasurementRecord(
    at=1.0, entity_id="E", attribute="a", value=1.0, unit="1", checked_at=2.0
)
store, queries = Store("sqlite:///history.sqlite"), Queries("sqlite:///history.sqlite")
store.write([Waiting(decision, 1, 0.0), Waiting(measurement, 2, 0.0)])

def is_ours(one, name, kind, *_):
    return kind != "index" and name not in EARLIER

def differences(connection):
    opts = {"include_object": is_ours}
    context = MigrationContext.configure(connection, opts=opts)
    return [str(one) for one in compare_metadata(context, metadata)]

async def ask(of):
    (kept,) = (await queries.page(of, Filter())).items
    return kept

told = {}
for of, model, key in (
    (lists.DECISIONS, Decision, "slope"),
    (lists.MEASUREMENTS, Measurement, "checked_at"),
):
    kept = asyncio.run(ask(of))
    written = csv_lines(of.kind, [kept], has_head=True).decode()
    first, row = written.splitlines()
    head = first.split(",")
    line = json.loads(ndjson_rows(model.from_record, [(kept,)]))
    told[key] = [
        getattr(kept, key),
        key in head and row.split(",")[head.index(key)],
        model.from_record(kept).model_dump(mode="json")[key] == line[key] and line[key],
        f"| `{key}` |" in describe(),
        f"| `{key}` |" in write_page(),
    ]
told["types of the page"] = "slope: number | null;" in write_types()
told["schema"] = asyncio.run(queries.ask(differences))
print(json.dumps(told))
"""


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the program with a column more of a decision and of a measurement."""
    copy = tmp_path_factory.mktemp("copy")
    unwanted = shutil.ignore_patterns("__pycache__", "vendor")
    for folder in ("iveg", "migrations"):
        shutil.copytree(ROOT / folder, copy / folder, ignore=unwanted)
    text = (copy / RECORDS).read_text()
    for kind, (anchor, line) in LINES.items():
        before, head, after = text.partition(f"class {kind}:")
        assert anchor in after
        text = before + head + after.replace(anchor, line + anchor, 1)
    (copy / RECORDS).write_text(text)
    (copy / "migrations/versions/more.py").write_text(MIGRATION)
    return copy


def test_a_column_is_one_line_and_its_migration(copied: Path) -> None:
    run = [sys.executable, "-c", ASKS]
    found = subprocess.run(run, cwd=copied, capture_output=True, check=False, env={})
    assert found.returncode == 0, found.stderr.decode()

    assert json.loads(found.stdout) == {
        "slope": [0.25, "0.25", 0.25, True, True],
        "checked_at": [
            2.0,
            "1970-01-01T00:00:02.000Z",
            "1970-01-01T00:00:02.000Z",
            True,
            True,
        ],
        "types of the page": True,
        "schema": [],
    }
