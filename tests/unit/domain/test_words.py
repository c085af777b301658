"""Words of detectors, in any writing, and class lists that nobody shifts."""

import pytest

from iveg.domain.detection_rule import DetectionRule, Meaning, meaning_of, plain
from iveg.domain.detector import name_numbers, read_classes
from iveg.domain.errors import UnreadableError
from iveg.domain.parameters import Class
from tests.builders import detection, detection_frame


@pytest.mark.parametrize(
    "word",
    [
        "person", "Persons", "PEOPLE", "persona", "Personas", "gente", "trabajador",
        "trabajadores", "niño", "NIÑA", "peatón", "hombre", "worker", "farmer",
        "human", "operator", "pedestrian", "person_0", "person2", "person:17",
        "0_person", "person-standing", "ｐｅｒｓｏｎ", "per\u0301sona",
        "person_with_crate",
        "person 2", "0: person", "farm worker", " Farmer ",
    ],
)  # fmt: skip
def test_a_person_is_a_person_in_any_writing(word: str) -> None:
    assert DetectionRule().class_of(word) == "person"


@pytest.mark.parametrize(
    ("word", "meaning"),
    [
        ("robot_1", "robot"), ("Robots", "robot"), ("AGV 3", "robot"),
        ("tomato", "harmless"), ("Tomates", "harmless"), ("crate_12", "harmless"),
        ("tractor", None), ("personal computer", None), ("tomato tractor", None),
        ("0", None), ("", None),
    ],
)  # fmt: skip
def test_other_words_mean_what_they_say(word: str, meaning: Meaning | None) -> None:
    assert meaning_of(word) == meaning


@pytest.mark.parametrize("aliases", [{}, {"farmer": "robot", "farmer_2": "robot"}])
def test_no_table_of_a_rule_takes_a_persons_word_away(
    aliases: dict[str, Class],
) -> None:
    assert DetectionRule(aliases=aliases).class_of("Farmer_2") == "person"


@pytest.mark.parametrize(
    "word",
    ["", " ", "0", "17", "٣", "0.0", "-1", "class_3", "cls0", "id: 4", "Label 2"],
)
def test_a_number_is_no_word(word: str) -> None:
    assert plain(word) == ""


def test_a_number_is_the_name_of_the_class_list_or_nothing() -> None:
    look = detection_frame("AGI", detection("1"), detection("2"), detection("tractor"))

    named = name_numbers(look, ("bicycle", "person"))

    assert [one.class_id for one in named.detections] == ["person", "tractor"]
    assert named.unread == (None,)


def test_a_class_list_has_a_name_a_line_with_or_without_its_number() -> None:
    assert read_classes("tomato\n farmer \n") == ("tomato", "farmer")
    assert read_classes("0: tomato\n1: farmer\n\n") == ("tomato", "farmer")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("person\n\nbicycle\n", "line 2"), ("\nperson\n", "line 1"),
        ("1: person\n2: bicycle\n", "line 1"), ("0: person\n2: bicycle\n", "line 2"),
        ("0 person\n", "line 1"), ("person\nPerson\n", "line 2"),
        ("person\n1\n", "line 2"), ("- person\n", "line 1"),
        ("# names\nperson\n", "line 1"), ("person,bicycle\n", "line 1"),
        ('["person", "bicycle"]\n', "line 1"),
    ],
)  # fmt: skip
def test_a_class_list_of_unsure_form_is_refused_by_line(text: str, line: str) -> None:
    with pytest.raises(UnreadableError) as error:
        read_classes(text)

    assert error.value.reason == line
