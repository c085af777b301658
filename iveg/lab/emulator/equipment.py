"""Simulated equipment: a fertigation unit and a reverse osmosis plant.

They know of nobody: their devices speak MQTT to the agent, as real ones would.
``iveg/data/equipment.toml`` shows them as tiles.
"""

import math
from collections.abc import Callable, Mapping

import orjson

from iveg.adapters.mqtt import MqttLink
from iveg.domain.stamps import format_stamp
from iveg.ngsi import names

Measures = Mapping[str, float]
_HOUR_S = 3600.0


def fertigation_at(wall: float) -> Measures:
    """Nutrient solution at a time (Unix s): flows in the first third of each hour."""
    phase = (wall % _HOUR_S) / _HOUR_S
    swing = math.sin(wall / 400.0)
    return {
        "conductivity": round(2.4 + 0.25 * swing, 3),
        "acidity": round(5.8 + 0.15 * math.cos(wall / 300.0), 2),
        "flow": 18.5 if phase < 1 / 3 else 0.0,
    }


def osmosis_at(wall: float) -> Measures:
    """Permeate and pressure: the membrane fouls until its rinse, each two hours."""
    fouling = (wall % (2 * _HOUR_S)) / (2 * _HOUR_S)
    return {
        "permeateConductivity": round(70.0 + 40.0 * fouling, 1),
        "pressure": round(9.0 + 2.5 * fouling, 2),
    }


EQUIPMENT: Mapping[str, Callable[[float], Measures]] = {
    "fertigation-1": fertigation_at,
    "osmosis-1": osmosis_at,
}
"""By device."""


def tell_all(link: MqttLink, apikey: str, wall: float) -> None:
    """Have each device send what it measures now."""
    for device, measure in EQUIPMENT.items():
        payload = orjson.dumps({**measure(wall), "TimeInstant": format_stamp(wall)})
        link.enqueue(names.measure_topic(apikey, device), payload)
