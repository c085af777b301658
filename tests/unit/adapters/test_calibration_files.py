import pytest

from iveg.adapters.calibration_files import read_calibrations
from iveg.domain.errors import DataFileError
from iveg.domain.tracking.looks import FARTHEST, PLAIN, logit

ONE = """\
[[calibrations]]
class = "person"
detector = "yolox"
right = 36
wrong = 6
mean_confidence = 0.72
"""


def complaint(text: str) -> str:
    with pytest.raises(DataFileError) as refused:
        read_calibrations(text, "rows.toml")
    return str(refused.value)


def test_a_row_is_of_its_detector_and_right_as_often_as_was_counted() -> None:
    rows = read_calibrations(ONE, "rows.toml")

    odds = rows.row_of("yolox", "person").log_odds(0.72)
    assert odds == pytest.approx(logit(36.5 / 43), abs=1e-9)
    assert rows.row_of("ssd", "person") == rows.row_of(None, "person") == PLAIN


def test_nothing_counted_is_certain() -> None:
    counts = ONE.replace("= 36", "= 9000000").replace("= 6", "= 0")

    row = read_calibrations(counts, "rows.toml").row_of("yolox", "person")
    assert row.offset == FARTHEST


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("right = 36", "rihgt = 36", "rows.toml, calibrations[0].rihgt"),
        ("= 0.72", "= 1.0", "rows.toml, calibrations[0].mean_confidence"),
        ('"person"', '"robot"', "rows.toml, calibrations[0].class"),
        ("right = 36\nwrong = 6", "right = 0\nwrong = 0", "counts no box"),
        (ONE, ONE + ONE, "rows.toml, calibrations[1].class: is of a detector"),
        (ONE, "", "calibrations"),
        (ONE, "right", "rows.toml: is not TOML"),
    ],
)
def test_a_complaint_names_the_key(before: str, after: str, said: str) -> None:
    assert said in complaint(ONE.replace(before, after))
