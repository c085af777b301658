"""A detector is proven to work by whole, young frames and by nothing else."""

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import (
    FRAMES_HZ,
    DetectorEvidence,
    OutOfService,
    flaw_of,
)
from iveg.domain.observations import DetectionFrame, Origin
from tests.builders import at

OUT = OutOfService("maria", 1.0, "boot-a")


def looked(moment: float = 0.0) -> DetectorEvidence:
    detector = DetectorEvidence()
    detector.note_whole(at(moment).mono)
    return detector


def frame(*unread: str | None) -> DetectionFrame:
    return DetectionFrame("AGI", Origin(), (), unread)


@pytest.mark.parametrize(("age", "missing"), [(1.0, False), (1.01, True)])
def test_a_whole_frame_proves_it_for_a_second(age: float, *, missing: bool) -> None:
    assert looked().is_missing(at(age)) is missing


def test_a_frame_whose_age_nobody_knows_proves_nothing() -> None:
    detector = DetectorEvidence()
    detector.note_whole(None)
    assert detector.is_missing(at(0.0))


@pytest.mark.parametrize(("age", "missing"), [(1.0, True), (1.01, False)])
def test_a_flaw_outweighs_whole_frames_for_a_second(
    age: float, *, missing: bool
) -> None:
    detector = looked(age)
    detector.note_flaw("unreadable", at(0.0))
    assert detector.is_missing(at(age)) is missing


def test_one_out_of_service_is_not_waited_for() -> None:
    assert not DetectorEvidence(out_of_service=OUT).is_missing(at(0.0))


def test_a_refused_frame_counts_even_out_of_service() -> None:
    detector = DetectorEvidence(out_of_service=OUT)
    detector.note_flaw("unreadable", at(0.0))
    assert detector.is_missing(at(0.5))


@pytest.mark.parametrize(
    ("boot", "ended"), [("boot-a", False), (None, False), ("boot-b", True)]
)
def test_the_next_boot_puts_it_back_in_service(
    boot: str | None, *, ended: bool
) -> None:
    detector = DetectorEvidence(out_of_service=OUT)
    assert detector.meet_boot(boot) is ended
    assert (detector.out_of_service is None) is ended


def test_forty_five_frames_a_second_are_judged_and_no_more() -> None:
    detector = DetectorEvidence()
    admitted = sum(detector.admits_frame(at(n / 200)) for n in range(2000))
    assert admitted == pytest.approx(FRAMES_HZ * 11, abs=1)


@pytest.mark.parametrize("class_id", ["farmer", " Husky ", None])
def test_an_unread_box_that_may_be_of_a_person_or_robot_is_a_flaw(
    class_id: str | None,
) -> None:
    assert flaw_of(frame("tomato", class_id), DetectionRule()) == "unreadable"


def test_a_tomato_without_depth_is_none() -> None:
    assert flaw_of(frame("tomato"), DetectionRule()) is None


def test_a_frame_with_somebody_whose_place_nobody_knows_is_not_whole() -> None:
    rule = DetectionRule()
    assert flaw_of(frame(), rule) is None
    assert flaw_of(frame(), rule, unplaced=1) == "unreadable"
    assert flaw_of(frame(), rule, unplaced=1, has_pose=False) == "unplaced"
