from pathlib import Path

import pytest

from iveg.adapters.greenhouses import load_greenhouse, read_greenhouse
from iveg.domain.errors import DataFileError

SMALL = """\
name = "shed"
bounds = { xmin = 0, ymin = 0, xmax = 10, ymax = 5 }

rows = [
  { xmin = 1, ymin = 1, xmax = 9, ymax = 2 },
  { xmin = 1, ymin = 3, xmax = 9, ymax = 4 },
]

[[lanes]]
label = "Pasillo 1"
xmin = 0
ymin = 2
xmax = 10
ymax = 3
"""


def test_the_testbed_of_the_paper_has_five_corridors_four_metres_apart() -> None:
    greenhouse = load_greenhouse("mvsim-20x20")
    corridors = [lane for lane in greenhouse.lanes if lane.label.startswith("Pasillo")]
    middles = [round((c.area.xmin + c.area.xmax) / 2) for c in corridors]

    assert middles == [2, 6, 10, 14, 18]
    assert greenhouse.lane_at(10.0, 10.0) == "Pasillo 3"


def test_agroconnect_has_the_papers_aisles_and_its_1850_square_metres() -> None:
    greenhouse = load_greenhouse("agroconnect")
    sizes = sorted(
        (round(lane.area.xmax - lane.area.xmin, 2), lane.area.ymax - lane.area.ymin)
        for lane in greenhouse.lanes
    )
    bounds = greenhouse.bounds

    assert sizes == [(2.0, 12.5)] * 11 + [(2.0, 22.5)] * 11 + [(50.0, 2.0)]
    assert (bounds.xmax - bounds.xmin) * (bounds.ymax - bounds.ymin) == 1850.0


def test_an_open_field_holds_every_position_of_the_wire_and_nothing_else() -> None:
    greenhouse = load_greenhouse("none")

    assert greenhouse.bounds.contains(-1e6, 1e6)
    assert greenhouse.rows == ()
    assert greenhouse.lanes == ()


def test_a_users_file_is_read_and_a_missing_one_is_told_with_the_names_that_exist(
    tmp_path: Path,
) -> None:
    file = tmp_path / "shed.toml"
    file.write_text(SMALL, "utf-8")

    greenhouse = load_greenhouse(str(file))

    assert (greenhouse.name, len(greenhouse.rows)) == ("shed", 2)
    assert greenhouse.lanes[0].label == "Pasillo 1"
    with pytest.raises(DataFileError, match="agroconnect"):
        load_greenhouse("no-such-house")


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ("xmax = 9, ymax = 4", 'xmax = "9", ymax = 4', "rows[1].xmax: Input sh"),
        ("ymin = 1, xmax = 9", "ymin = 7, xmax = 9", "rows[0]: ymin must be less"),
        ('label = "Pasillo 1"\n', "", "lanes[0].label: Field required."),
        ("xmax = 9, ymax = 4", "xmax = 90, ymax = 4", "rows[1]: lies outside b"),
    ],
)
def test_what_cannot_be_is_refused_with_file_and_field(
    right: str, wrong: str, said: str
) -> None:
    with pytest.raises(DataFileError) as refused:
        read_greenhouse(SMALL.replace(right, wrong), "shed.toml")

    assert str(refused.value).startswith(f"shed.toml, {said}")
