"""A small sensor is whole: who forgets a step of "Add a sensor" reads which file."""

import json

import pytest

from iveg.domain import observations
from iveg.domain.kinds import KINDS, SENSED, Kind
from iveg.domain.observations import Observation
from iveg.domain.quantities import flags_of
from iveg.lab.emulator.world import EMULATED
from iveg.robot.ros2.topics import ROS_SENSORS
from tests.processes import ROOT

_RECEIVED_AS_ANOTHER = {"Copy", "RefusedFrame", "Unplaced"}


def words_of(kind: Kind) -> set[str]:
    """Keys of the sentences that pages and alerts have of a small sensor."""
    low = [f"alert.{kind.name}_low"] if kind.sensor and kind.sensor.low else []
    endings = ("", "_level", *(f"_{flag}" for flag in flags_of(kind.type_)))
    return {
        *(f"robot.{kind.name}{ending}" for ending in endings),
        *low,
    }


def found(words: object, key: str) -> object:
    for part in key.split("."):
        words = words.get(part) if isinstance(words, dict) else None
    return words


def test_every_observation_has_one_row() -> None:
    kinds = {
        name
        for name, one in vars(observations).items()
        if isinstance(one, type) and issubclass(one, Observation)
    } - {"Observation", *_RECEIVED_AS_ANOTHER}

    told = sorted(row.type_.__name__ for row in KINDS)
    assert told == sorted(kinds), "iveg/domain/kinds.py"


@pytest.mark.parametrize("kind", SENSED, ids=lambda kind: kind.name)
@pytest.mark.parametrize("language", ["en", "es"])
def test_every_sensor_has_its_words(language: str, kind: Kind) -> None:
    file = f"iveg/static/i18n/{language}.json"
    words = json.loads((ROOT / file).read_text())

    assert {key for key in words_of(kind) if not found(words, key)} == set(), file


def test_every_sensor_is_emulated() -> None:
    assert set(EMULATED) == {row.type_ for row in SENSED}, "iveg/lab/emulator/world.py"


def test_every_sensor_has_its_topic_on_a_ros_2_robot() -> None:
    assert set(ROS_SENSORS) == {one.name for one in SENSED}, "iveg/robot/ros2/topics.py"
