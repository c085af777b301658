"""The rule of Algorithm 2 and its ring, exact at the borders (fault F47)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.detection_rule import RECOVERED, DetectionRule, strictest

RULE = DetectionRule()


@pytest.mark.parametrize(
    ("confidence", "kind"),
    [
        (0.79, "faint"),
        (0.7999999, "faint"),
        (0.80, "alert"),
        (0.8000001, "alert"),
        (1.0, "alert"),
        (0.0, "faint"),
    ],
)
def test_the_threshold_is_080_inclusive(confidence: float, kind: str) -> None:
    assert RULE.judge("person", confidence).kind == kind


@pytest.mark.parametrize(
    "word",
    ["person", "farmer", "human", "operator", "worker", "pedestrian", " Farmer "],
)
def test_every_word_for_a_person_is_a_person(word: str) -> None:
    assert RULE.judge(word, 0.9).class_ == "person"


@pytest.mark.parametrize("word", ["robot", "AGI", "AGII", "husky"])
def test_every_word_for_a_robot_is_a_robot(word: str) -> None:
    assert RULE.judge(word, 0.9).class_ == "robot"


def test_a_confident_unmapped_class_is_another_object() -> None:
    verdict = RULE.judge("crate", 0.95)

    assert (verdict.kind, verdict.class_) == ("other", None)


def test_a_faint_unmapped_class_is_faint() -> None:
    assert RULE.judge("crate", 0.5).kind == "faint"


def test_a_class_may_have_a_threshold_of_its_own() -> None:
    rule = DetectionRule(class_thresholds={"person": 0.6})

    assert rule.judge("farmer", 0.6).kind == "alert"
    assert rule.judge("robot", 0.6).kind == "faint"


@pytest.mark.parametrize(
    ("age", "radius"),
    [
        (0.0, 2.0),
        (0.32, 2.0),
        (0.42, 2.16),
        (1.32, 3.6),
        (2.32, 5.2),
        (2.82, 6.0),
        (9.9, 6.0),
    ],
)
def test_the_ring_grows_at_walking_speed_and_ends_at_six_metres(
    age: float, radius: float
) -> None:
    assert RULE.radius_at(age) == pytest.approx(radius)


def test_a_fresh_ring_is_exactly_the_papers() -> None:
    assert RULE.radius_at(0.32) == 2.0


def test_growth_never_makes_a_ring_smaller_than_it_was_set() -> None:
    assert DetectionRule(radius_m=7.0).radius_at(5.0) == 7.0


_WORDS = st.sampled_from(["person", "robot", "abuela", "carro"])
_CLASSES = st.sampled_from(["person", "robot"])
_SHARES = st.sampled_from([0.0, 0.5, 0.6, 0.8, 1.0])
_RULES = st.builds(
    DetectionRule,
    version=st.integers(1, 9),
    threshold=_SHARES,
    class_thresholds=st.dictionaries(_CLASSES, _SHARES),
    radius_m=st.floats(0.5, 6.0),
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
    assert all(strict.radius_m >= rule.radius_m for rule in rules)
    assert strict.possible_people
    assert all(strict.version > rule.version for rule in rules)
    assert (strict.author, strict.since) == (RECOVERED, 7.0)


def test_a_word_for_a_person_in_one_rule_is_one_in_the_strictest() -> None:
    rules = [
        DetectionRule(aliases={"carro": "person"}),
        DetectionRule(aliases={"carro": "robot"}),
    ]

    assert strictest(rules, 0.0).judge("carro", 1.0).class_ == "person"
