from pathlib import Path

import pytest

from iveg.adapters.greenhouses import BUILT_IN, load_greenhouse, read_greenhouse
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


def complaint(text: str) -> str:
    with pytest.raises(DataFileError) as refused:
        read_greenhouse(text, "shed.toml")
    return str(refused.value)


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_built_in_greenhouse_loads_under_its_own_name(name: str) -> None:
    assert load_greenhouse(name).name == name


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


def test_crop_hides_one_corridor_from_the_next() -> None:
    greenhouse = load_greenhouse("mvsim-20x20")

    assert not greenhouse.in_sight(10.0, 10.0, 14.0, 10.0)
    assert greenhouse.in_sight(10.0, 5.0, 10.0, 15.0)


def test_an_open_field_holds_every_position_of_the_wire_and_nothing_else() -> None:
    greenhouse = load_greenhouse("none")

    assert greenhouse.bounds.contains(-1e6, 1e6)
    assert greenhouse.rows == ()
    assert greenhouse.lanes == ()


def test_a_users_file_is_read_from_disk(tmp_path: Path) -> None:
    file = tmp_path / "shed.toml"
    file.write_text(SMALL, "utf-8")

    greenhouse = load_greenhouse(str(file))

    assert greenhouse.name == "shed"
    assert len(greenhouse.rows) == 2
    assert greenhouse.lanes[0].label == "Pasillo 1"


def test_a_missing_file_is_refused_with_the_names_that_exist() -> None:
    with pytest.raises(DataFileError, match="agroconnect"):
        load_greenhouse("no-such-house")


def test_a_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "shed.toml"
    file.write_bytes(b"\xff\xfe\x00")

    with pytest.raises(DataFileError, match="UTF-8"):
        load_greenhouse(str(file))


def test_a_bad_number_is_refused_with_file_line_and_field() -> None:
    said = complaint(SMALL.replace("xmax = 9, ymax = 4", 'xmax = "9", ymax = 4'))

    assert said.startswith(
        "shed.toml:6:25, rows[1].xmax: Input should be a valid number"
    )


def test_a_row_turned_inside_out_is_refused() -> None:
    said = complaint(SMALL.replace("ymin = 1, xmax = 9", "ymin = 7, xmax = 9"))

    assert said == "shed.toml:5:3, rows[0]: ymin must be less than ymax."


def test_a_lane_without_a_label_is_refused_at_its_heading() -> None:
    said = complaint(SMALL.replace('label = "Pasillo 1"\n', ""))

    assert said == "shed.toml:9:1, lanes[0].label: Field required."


def test_a_misspelt_field_is_refused_at_its_place() -> None:
    said = complaint(SMALL.replace("xmin = 1, ymin = 3", "xmim = 1, ymin = 3"))

    assert said == "shed.toml:6:5, rows[1].xmim: Extra inputs are not permitted."


def test_what_lies_outside_the_wall_is_refused() -> None:
    said = complaint(SMALL.replace("xmax = 9, ymax = 4", "xmax = 90, ymax = 4"))

    assert said == "shed.toml:6:3, rows[1]: lies outside bounds."


@pytest.mark.parametrize("number", ["nan", "inf", "1e7", "true", "[]"])
def test_only_finite_numbers_of_the_contract_are_taken(number: str) -> None:
    said = complaint(SMALL.replace("xmin = 1, ymin = 3", f"xmin = {number}, ymin = 3"))

    assert said.startswith("shed.toml:6:5, rows[1].xmin: Input should be ")


@pytest.mark.parametrize(
    ("text", "line"),
    [("name = \n", 1), (SMALL + "xmid = 3 3\n", 15), ("name = 'a'\nbounds = {", 2)],
)
def test_broken_toml_is_refused_with_its_line(text: str, line: int) -> None:
    assert complaint(text).startswith(f"shed.toml:{line}:")


def test_a_file_without_bounds_is_refused() -> None:
    assert complaint('name = "a"') == "shed.toml:1:1, bounds: Field required."


def test_a_list_of_something_else_is_refused() -> None:
    said = complaint(SMALL.replace("rows = [", "posts = [3]\nrows = ["))

    assert said.startswith("shed.toml:4:1, posts[0]: Input should be a valid dict")


@pytest.mark.parametrize("label", ['""', '"' + "P" * 65 + '"', "7"])
def test_a_label_that_nobody_can_read_is_refused(label: str) -> None:
    said = complaint(SMALL.replace('"Pasillo 1"', label))

    assert said.startswith("shed.toml:10:1, lanes[0].label: ")


def test_bounds_that_are_no_table_are_refused() -> None:
    said = complaint('name = "a"\nbounds = 3')

    assert said.startswith("shed.toml:2:1, bounds: Input should be a valid dict")


def test_rows_that_are_no_list_are_refused() -> None:
    said = complaint(SMALL.replace("rows = [", "posts = 3\nrows = ["))

    assert said == "shed.toml:4:1, posts: Input should be a valid list."


def test_posts_and_starts_of_a_users_greenhouse_are_read() -> None:
    more = (
        "\n[[posts]]\nx = 1\ny = 2.5\nradius = 0.1\n[[starts]]\nx = 1\ny = 2\nyaw = 0\n"
    )

    greenhouse = read_greenhouse(SMALL + more, "shed.toml")

    assert (greenhouse.posts[0].x, greenhouse.posts[0].radius) == (1.0, 0.1)
    assert greenhouse.starts[0].y == 2.0


def test_an_unknown_key_is_named_whatever_is_in_it() -> None:
    said = complaint(SMALL.replace("rows = [", '"wall(" = 3\nrows = ['))

    assert "wall(: Extra inputs are not permitted" in said
