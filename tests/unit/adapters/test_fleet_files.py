from pathlib import Path

import pytest

from iveg.adapters.fleet_files import built_in, load_fleet, read_fleet
from iveg.domain.errors import DataFileError
from iveg.domain.fleet import CAUTIOUS, RobotDescription
from tests.processes import ROOT

ONE = """\
[[robots]]
id = "B1"
kind = "recording"

[robots.body]
length_m = 1.1
width_m = 0.7

[robots.drive]
type = "ackermann"
max_speed_m_s = 0.6
turning_radius_m = 1.5
braking_m_s2 = 0.9
assumed_braking_m_s2 = 0.4

[[robots]]
id = "B2"
camera = { x_m = 0.2, fov_deg = 90, range_m = 5.0, unlabelled_frame = "camera_link" }
"""


def complaint(text: str) -> str:
    with pytest.raises(DataFileError) as refused:
        read_fleet(text, "fleet.toml")
    return str(refused.value)


def test_what_the_file_says_of_a_robot_is_what_is_known_of_it() -> None:
    one = read_fleet(ONE, "fleet.toml").of_robot("B1")

    assert (one.kind, one.is_described) == ("recording", True)
    assert (one.profile.length, one.profile.width) == (1.1, 0.7)
    assert (one.profile.drive, one.profile.turning_radius) == ("ackermann", 1.5)
    assert (one.profile.max_speed, one.profile.assumed_braking) == (0.6, 0.4)
    assert one.profile.camera_fov == CAUTIOUS.camera_fov
    assert one.profile.unlabelled_frame is None


def test_frames_and_classes_of_a_robot_are_what_its_messages_name() -> None:
    said = 'pose_frame = "odom"\nclasses = """\nperson\ntractor\n"""\n'
    text = ONE.replace("camera = { ", said + 'camera = { frame = "zed_link", ')

    one = read_fleet(text, "").of_robot("B2")

    assert (one.pose_frame, one.classes) == ("odom", ("person", "tractor"))
    assert one.profile.camera_frame == "zed_link"


def test_a_class_list_of_unsure_form_is_refused_by_its_line() -> None:
    text = ONE.replace("camera =", 'classes = """\n1: person\n"""\ncamera =')

    assert complaint(text).startswith("fleet.toml, robots[1].classes: line 1 has")


def test_margins_never_count_on_better_brakes_than_the_drive_has() -> None:
    text = ONE.replace("assumed_braking_m_s2 = 0.4\n", "").replace("= 0.9", "= 0.2")

    assert read_fleet(text, "").of_robot("B1").profile.assumed_braking == 0.2


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("length_m = 1.1", "lenght_m = 1", "fleet.toml, robots[0].body.lenght_m:"),
        ("width_m = 0.7\n", "", "fleet.toml, robots[0].body.width_m:"),
        ('"B1"', '"B 1"', "fleet.toml, robots[0].id: must be 1 to 64 letters"),
        ('"B2"', '"B1"', "fleet.toml, robots[1].id: B1 is in the list twice"),
        ("fov_deg = 90", 'fov_deg = "wide"', "fleet.toml, robots[1].camera.fov"),
        ('"camera_link"', '"odom"', "fleet.toml, robots[1].camera.unlabelled_f"),
        ("= 0.4", "= 1.4", "fleet.toml, robots[0].drive: assumed_braking_m_s2 m"),
        ("kind =", "kind", "fleet.toml: is not TOML:"),
    ],
)
def test_what_is_wrong_is_named_by_file_and_key(old: str, new: str, place: str) -> None:
    assert complaint(ONE.replace(old, new)).startswith(place)


def test_words_choose_who_is_in_the_fleet_and_what_plays(tmp_path: Path) -> None:
    file = tmp_path / "fleet.toml"
    file.write_text(ONE)

    everybody = load_fleet(str(file))
    fleet = load_fleet(str(file), ("B1:live", "AGII", "D1:recording"))

    assert everybody.ids == ("B1", "B2")
    assert fleet.ids == ("B1", "AGII", "D1")
    b1 = fleet.of_robot("B1")
    assert (b1.kind, b1.profile.length) == ("live", 1.1)
    assert fleet.of_robot("AGII") == built_in().of_robot("AGII")
    assert fleet.of_robot("D1") == RobotDescription("D1", "recording")


def test_the_example_of_the_documents_can_be_used() -> None:
    fleet = load_fleet(str(ROOT / "deploy/fleet.example.toml"))

    assert fleet.ids == ("AGI", "CARRIER-2", "D1")
    assert [one.kind for one in fleet.members.values()] == ["live", "live", "recording"]
    assert fleet.of_robot("CARRIER-2").is_described
