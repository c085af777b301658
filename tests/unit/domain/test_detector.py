"""A detector is proven to work by whole, young frames and by nothing else."""

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import (
    FRAMES_HZ,
    DetectorEvidence,
    OutOfService,
    WordAnswers,
    judge_frame,
)
from iveg.domain.observations import DetectionFrame, Origin
from tests.builders import at

OUT = OutOfService("maria", 1.0, "boot-a")


def looked(moment: float | None) -> DetectorEvidence:
    detector = DetectorEvidence()
    detector.note_whole(None if moment is None else at(moment).mono)
    return detector


@pytest.mark.parametrize(
    ("seen", "age", "missing"),
    [(0.0, 1.0, False), (0.0, 1.01, True), (None, 0.0, True)],
)
def test_a_whole_frame_of_known_age_proves_it_for_a_second(
    seen: float | None, age: float, *, missing: bool
) -> None:
    assert looked(seen).is_missing(at(age)) is missing


@pytest.mark.parametrize(("age", "missing"), [(1.0, True), (1.01, False)])
def test_a_flaw_outweighs_whole_frames_for_a_second(
    age: float, *, missing: bool
) -> None:
    detector = looked(age)
    detector.note_flaw("unreadable", at(0.0))
    assert detector.is_missing(at(age)) is missing


def test_one_out_of_service_is_not_waited_for_and_its_refused_frame_counts() -> None:
    detector = DetectorEvidence(out_of_service=OUT)
    assert not detector.is_missing(at(0.0))
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


@pytest.mark.parametrize(
    ("unread", "unplaced", "has_pose", "flaw"),
    [
        ((), 0, True, None),
        (("tomato",), 0, True, None),
        (("tomato", "farmer"), 0, True, "unreadable"),
        ((" Husky ",), 0, True, "unreadable"),
        ((None,), 0, True, "unreadable"),
        ((), 1, True, "unreadable"),
        ((), 1, False, "unplaced"),
    ],
)
def test_a_frame_with_a_box_that_may_be_somebody_and_has_no_place_is_not_whole(
    unread: tuple[str | None, ...], unplaced: int, has_pose: bool, flaw: str | None
) -> None:
    frame = DetectionFrame("AGI", Origin(), (), unread)

    judged = judge_frame(frame, DetectionRule(), (), WordAnswers())
    found = DetectorEvidence().take_frame(judged, 0, unplaced, has_pose=has_pose)

    assert found == flaw
