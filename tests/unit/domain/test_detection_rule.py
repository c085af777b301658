"""The rule of Algorithm 2 and its ring, exact at the borders (fault F47)."""

import pytest

from iveg.domain.detection_rule import DetectionRule

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
