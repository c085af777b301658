"""The safety numbers stand once; what judges by them agrees."""

import json
from dataclasses import Field, fields
from typing import Any

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.limits import LIMITS, grown_radius
from iveg.domain.parameters import ByClass
from iveg.robot.judgement import Limits
from iveg.settings import Settings
from tests.processes import ROOT

RINGS = json.loads((ROOT / "tests/data/rings.json").read_text())
"""Cases that ``tests/js/limits.test.js`` judges, too."""


@pytest.mark.parametrize("case", RINGS, ids=lambda one: f"{one}")
def test_the_ring_law_gives_the_shared_cases(case: dict[str, float]) -> None:
    rule = DetectionRule(radius_m=ByClass(case["radius_m"]))

    radius_m = grown_radius(rule.radius_m.for_class("person"), case["age_s"])
    assert radius_m == pytest.approx(case["ring_m"], abs=1e-6)


def test_rule_robot_and_settings_begin_with_the_limits() -> None:
    settings, robot = Settings(), Limits()

    assert settings.rule.radius_m == ByClass(LIMITS.zone_default_m)
    assert DetectionRule.from_parameters(settings.rule) == DetectionRule()
    assert settings.feedback_stand_s == robot.stand_s == LIMITS.feedback_stand_s
    assert settings.feedback_slow_s == robot.slow_s == LIMITS.feedback_slow_s


@pytest.mark.parametrize("row", fields(LIMITS), ids=lambda row: row.name)
def test_the_safety_page_prints_the_limit(row: Field[Any]) -> None:
    page = (ROOT / "docs/safety.md").read_text()
    assert getattr(LIMITS, row.name) > 0
    value, facts = f"{row.default:g} {row.metadata['unit']}", row.metadata

    line = f"| `{row.name}` | {value} | {facts['says']} | {facts['source']} |"
    assert f"\n{line}\n" in page
