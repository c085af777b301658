"""A parameter of the rule is one row: added in a copy, it is wherever it has to be."""

import json
import math
import shutil
import subprocess
import sys
from dataclasses import field, fields, make_dataclass
from pathlib import Path
from types import MappingProxyType

import pytest

from iveg.domain.parameters import PARAMETERS, Parameters, parameters_of
from tests.processes import ROOT

TABLE = "iveg/domain/parameters.py"
TEXTS = ("iveg/static/i18n/en.json", "iveg/static/i18n/es.json")
ROW = """
    pause_s: ByClass = _row(
        ByClass(1.0, {"robot": 2.0}),
        key="pause_s",
        class_key="class_pauses_s",
        unit="s",
        least=0.0,
        most=5.0,
        protects="more",
        variable="IVEG_PAUSE_S",
        says="How long a robot pauses (s).",
        word="pause",
        robots=True,
    )


_ROWS ="""
ASKS = """
import json
from iveg.adapters.rules import StoredRule, rule_fields
from iveg.domain.detection_rule import DetectionRule, strictest
from iveg.domain.feedback import Feedback
from iveg.domain.observations import Origin
from iveg.domain.parameters import ByClass, for_class, sent_to_robots
from iveg.models.rule import Rule
from iveg.ngsi import codec
from iveg.settings import Settings, describe
from iveg.web.api.rule import RuleChange
from iveg.web.pages.contexts import Appearance, PageFrame, Site
from iveg.web.pages.drawing import environment_of
from iveg.web.pages.sentences import read_sentences
from iveg.web.security.audited import AUDITED

settings = Settings.from_environment({"IVEG_PAUSE_S": "2,person=3"})
rule = DetectionRule.from_parameters(settings.rule)
change = RuleChange(class_pauses_s={"person": 4.0})
line = json.dumps(rule_fields(rule))
site = Site("none", ("AGI",), "1", demo=False)
frame = PageFrame(site, Appearance("en"), "settings", "ana", "operator")
drawn = environment_of(read_sentences("en")).get_template("settings.html")
html = drawn.render(page={"frame": frame})
told = Feedback("AGI", Origin("b", 1), rule=sent_to_robots(rule))
print(json.dumps({
    "settings": settings.to_environment()["IVEG_PAUSE_S"],
    "page of settings": "IVEG_PAUSE_S" in describe(),
    "rest": Rule.from_rule(rule).model_dump()["class_pauses_s"],
    "body": change.applied_to(rule).pause_s.for_class("person"),
    "stored": StoredRule.model_validate_json(line).rule() == rule,
    "strictest": strictest([rule, DetectionRule()], 0.0).pause_s.every,
    "audit": "class_pauses_s" in AUDITED["PUT", "/api/v1/rule"].sent,
    "evidence": for_class(rule, "person")["pause_s"],
    "feedback": codec.read_feedback(codec.write_feedback(told)).rule["pause_s"],
    "form": [one in html for one in ("rule-new-pause", "rule-new-pause-robot")],
}))
"""


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the program with one more parameter, in three files."""
    copy = tmp_path_factory.mktemp("copy")
    shutil.copytree(
        ROOT / "iveg", copy / "iveg", ignore=shutil.ignore_patterns("__pycache__")
    )
    table = copy / TABLE
    table.write_text(table.read_text().replace("\n\n_ROWS =", ROW, 1))
    for path in TEXTS:
        texts = json.loads((copy / path).read_text())
        texts["rule"]["part"]["pause"] = texts["lowering"]["pause"] = "Pause"
        (copy / path).write_text(json.dumps(texts))
    return copy


def test_a_further_parameter_of_a_class_is_one_row_and_its_texts(copied: Path) -> None:
    run = [sys.executable, "-c", ASKS]
    found = subprocess.run(run, cwd=copied, capture_output=True, check=False, env={})
    assert found.returncode == 0, found.stderr.decode()

    assert json.loads(found.stdout) == {
        "settings": "2.0,person=3.0",
        "page of settings": True,
        "rest": {"person": 3.0},
        "body": 4.0,
        "stored": True,
        "strictest": 3.0,
        "audit": True,
        "evidence": 3.0,
        "feedback": {"person": 3.0, "robot": 2.0},
        "form": [True, True],
    }


def test_nothing_but_the_table_names_the_radius_by_class(copied: Path) -> None:
    spelled = {
        str(path.relative_to(ROOT))
        for path in (ROOT / "iveg").rglob("*")
        if path.suffix in (".py", ".js", ".html")
        and "class_radii_m" in path.read_text()
    }

    assert spelled == {TABLE, "iveg/static/js/pages/about.js"}


@pytest.mark.parametrize(
    "wrong",
    [
        {"least": 9.0}, {"most": math.inf}, {"class_key": "classes"}, {"key": ""},
        {"unit": "switch"}, {"unit": "seconds"}, {"protects": "greater"},
        {"variable": "S"}, {"variable": "IVEG_FORESIGHT"}, {"key": "radius_m"},
    ],
)  # fmt: skip
def test_a_wrong_row_is_refused_by_name(wrong: dict[str, object]) -> None:
    metadata = {row.name: row.metadata for row in fields(Parameters)}
    metadata["foresight_s"] = MappingProxyType({**metadata["foresight_s"], **wrong})
    rows = [(name, object, field(metadata=row)) for name, row in metadata.items()]

    with pytest.raises(ValueError, match=r"(?i)foresight|radius_m"):
        parameters_of(make_dataclass("Table", rows))


@pytest.mark.parametrize("path", TEXTS)
def test_each_parameter_has_its_texts(path: str) -> None:
    texts = json.loads((ROOT / path).read_text())

    words = {row.word for row in PARAMETERS}
    assert words <= texts["rule"]["part"].keys() & texts["lowering"].keys()
