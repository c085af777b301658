"""The rule of Algorithm 2 and its ring, exact at the borders (fault F47)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.detection_rule import RECOVERED, DetectionRule, strictest
from iveg.domain.parameters import ByClass

RULE = DetectionRule()


@pytest.mark.parametrize(
    ("confidence", "kind"),
    [
        (0.79, "faint"), (0.7999999, "faint"), (0.80, "alert"), (0.8000001, "alert"),
        (1.0, "alert"), (0.0, "faint"),
    ],
)  # fmt: skip
def test_the_threshold_is_080_inclusive(confidence: float, kind: str) -> None:
    assert RULE.judge("person", confidence).kind == kind


def test_a_class_may_have_a_threshold_of_its_own() -> None:
    rule = DetectionRule(threshold=ByClass(0.8, {"person": 0.6}))

    assert rule.judge("farmer", 0.6).kind == "alert"
    assert rule.judge("robot", 0.6).kind == "faint"


_WORDS = st.sampled_from(["person", "robot", "abuela", "carro"])
_CLASSES = st.sampled_from(["person", "robot"])
_SHARES = st.sampled_from([0.0, 0.5, 0.6, 0.8, 1.0])
_METRES = st.floats(0.5, 6.0)
_RULES = st.builds(
    DetectionRule,
    version=st.integers(1, 9),
    threshold=st.builds(ByClass, _SHARES, st.dictionaries(_CLASSES, _SHARES)),
    radius_m=st.builds(ByClass, _METRES, st.dictionaries(_CLASSES, _METRES)),
    foresight=st.booleans(),
    foresight_s=st.floats(0.5, 3.0),
    aliases=st.dictionaries(_WORDS, _CLASSES),
    possible_people=st.booleans(),
)


@given(st.lists(_RULES, min_size=1, max_size=5), _WORDS, _SHARES)
def test_the_strictest_rule_slows_wherever_one_of_them_would(
    rules: list[DetectionRule], word: str, confidence: float
) -> None:
    strict = strictest(rules, 7.0)

    alerts = [rule.judge(word, confidence).kind == "alert" for rule in rules]
    assert strict.judge(word, confidence).kind == "alert" or not any(alerts)
    for rule in rules:
        assert strict.radius_m.for_class(None) >= max(rule.radius_m.values)
        assert strict.foresight >= rule.foresight
        assert strict.foresight_s >= rule.foresight_s
    assert strict.possible_people
    assert all(strict.version > rule.version for rule in rules)
    assert (strict.author, strict.since) == (RECOVERED, 7.0)
