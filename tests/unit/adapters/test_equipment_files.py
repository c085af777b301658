import pytest

from iveg.adapters.equipment_files import DEMO, load_equipment, read_equipment
from iveg.domain.errors import DataFileError
from iveg.lab.emulator.fleet import measures_of

ONE = """\
[[tiles]]
entity = "panel-1"
type = "ThermalPanel"
attribute = "outlet"
name = { es = "Panel: salida", en = "Panel: outlet" }
unit = "°C"
low = 5
high = 60.0
place = { x = 1.0, y = 2 }
device = "panel-1"
"""
OTHER = ONE.replace('"outlet"', '"inlet"').replace("panel-1", "panel-2")


def complaint(text: str) -> str:
    with pytest.raises(DataFileError) as refused:
        read_equipment(text, "tiles.toml", ["AGI"])
    return str(refused.value)


def test_what_the_file_says_is_the_tile() -> None:
    one, other = read_equipment(ONE + OTHER, "tiles.toml")

    assert (one.key, other.key) == ("panel-1/outlet", "panel-2/inlet")
    assert one.name == {"es": "Panel: salida", "en": "Panel: outlet"}
    assert one.limits == {"low": 5.0, "high": 60.0}
    assert (one.place, one.silent_after_s, one.device) == ((1.0, 2.0), 300.0, "panel-1")


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("high = 60.0", "hihg = 60.0", "tiles.toml, tiles[0].hihg"),
        ("high = 60.0", "high = 5", "tiles.toml, tiles[0]: low_low, low, high"),
        ('"°C"', '"bananas"', "tiles.toml, tiles[0].unit: must be one of °C"),
        ('"ThermalPanel"', '"Robot"', "tiles[0].type: Robot is no equipment"),
        ('entity = "panel-1"', 'entity = "greenhouse-climate"', "tiles already"),
        ('entity = "panel-1"', 'entity = "AGI"', "AGI is a robot of the fleet"),
        ('device = "panel-1"', 'device = "AGI"', "tiles[0].device: AGI is a robot"),
        ('device = "panel-1"', 'device = "climate"', "and not iVeg's"),
        ('attribute = "outlet"\n', "", "tiles.toml, tiles[0].attribute"),
    ],
)
def test_a_file_that_cannot_be_used_is_one_sentence_with_its_key(
    before: str, after: str, said: str
) -> None:
    assert before in ONE

    found = complaint(ONE.replace(before, after))

    assert said in found
    assert len(found.splitlines()) == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (ONE + ONE, "tiles.toml, tiles[1].attribute: panel-1/outlet has a tile"),
        (
            ONE + ONE.replace('"outlet"', '"inlet"').replace("ThermalPanel", "Boiler"),
            "tiles.toml, tiles[1].type: panel-1 is a ThermalPanel",
        ),
        (
            ONE + OTHER.replace('device = "panel-2"', 'device = "panel-1"'),
            "tiles.toml, tiles[1].device: panel-1 feeds panel-1",
        ),
        ("tiles = []", "tiles.toml, tiles"),
    ],
)
def test_tiles_that_contradict_each_other_are_refused(text: str, said: str) -> None:
    assert said in complaint(text)


def test_the_emulator_measures_each_tile_of_the_demo() -> None:
    for tile in load_equipment(DEMO):
        value = measures_of(tile.device, 1_795_000_000.0)[tile.attribute]
        assert tile.limits.get("low", value) <= value <= tile.limits.get("high", value)
