"""The hues of robots: seen on every ground, told apart by everybody, unlike an alert.

Differences are distances in OKLab (Ottosson, 2020), where 0.02 is just noticeable; what
colour-blind people see is simulated after Machado, Oliveira and Fernandes (2009).
"""

import re
from importlib.resources import files
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from iveg.web.pages.contexts import HUES, Site

STATIC = files("iveg") / "static"
Colours = NDArray[np.float64]
"""Rows of linear sRGB."""

_TO_LMS = [
    [0.4122214708, 0.5363325363, 0.0514459929],
    [0.2119034982, 0.6806995451, 0.1073969566],
    [0.0883024619, 0.2817188376, 0.6299787005],
]
_TO_LAB = [
    [0.2104542553, 0.7936177850, -0.0040720468],
    [1.9779984951, -2.4285922050, 0.4505937099],
    [0.0259040371, 0.7827717662, -0.8086757660],
]
_BLIND = {
    "protan": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deutan": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritan": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
_THEMES = {
    "light": ":root,\n.on-paper",
    "dark": ':root[data-theme="dark"]',
    "auto": ':root[data-theme="auto"]',
    "sunlight": ':root[data-theme="sunlight"]',
}
_GROUNDS = ("map-bg", "map-lane", "map-crop", "surface", "raised")


def tokens(theme: str) -> dict[str, str]:
    sheet = (STATIC / "css/tokens.css").read_text()
    block = sheet.split(f"{_THEMES[theme]} {{", 1)[1].split("}", 1)[0]
    return dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6});", block))


def linear(*colours: str) -> Colours:
    channels = [[int(one[i : i + 2], 16) for i in (1, 3, 5)] for one in colours]
    of = np.array(channels) / 255
    return np.where(of <= 0.04045, of / 12.92, ((of + 0.055) / 1.055) ** 2.4)


def lab(colours: Colours) -> Colours:
    found: Colours = np.cbrt(colours @ np.transpose(_TO_LMS)) @ np.transpose(_TO_LAB)
    return found


def seen_by(eye: str, colours: Colours) -> Colours:
    return lab(np.clip(colours @ np.transpose(_BLIND[eye]), 0.0, 1.0))


def nearest(seen: Colours) -> float:
    return min(float(np.linalg.norm(a - b)) for a, b in combinations(seen, 2))


def robots(theme: str) -> Colours:
    known = tokens(theme)
    return linear(*(known[f"robot-{n}"] for n in range(1, HUES + 1)))


@pytest.mark.parametrize("theme", _THEMES)
def test_ten_hues_differ_and_none_is_an_alert(theme: str) -> None:
    known, hues = tokens(theme), lab(robots(theme))
    alerts = lab(linear(known["alert-1"], known["alert-2"]))

    assert nearest(hues) >= 0.08
    assert np.linalg.norm(hues[:, None] - alerts[None], axis=2).min() >= 0.12


@pytest.mark.parametrize("eye", _BLIND)
@pytest.mark.parametrize("theme", _THEMES)
def test_plain_and_striped_hues_each_differ_for_the_colour_blind(
    theme: str, eye: str
) -> None:
    hues = seen_by(eye, robots(theme))

    assert min(nearest(hues[: HUES // 2]), nearest(hues[HUES // 2 :])) >= 0.055


@pytest.mark.parametrize("theme", _THEMES)
def test_each_hue_is_seen_on_every_ground(theme: str) -> None:
    known = {**tokens("light"), **tokens(theme)}
    weights = np.array([0.2126, 0.7152, 0.0722])
    own = robots(theme) @ weights + 0.05
    grounds = linear(*(known[one] for one in _GROUNDS)) @ weights + 0.05
    ratios = own[:, None] / grounds[None]

    assert np.maximum(ratios, 1 / ratios).min() >= 3.0


def test_the_place_in_the_fleet_names_a_hue_and_ten_are_ten() -> None:
    fleet = tuple(f"R{n}" for n in range(1, 12))
    slots = Site("x", fleet, "1", demo=False).slots

    assert [slots[robot] for robot in fleet] == [*range(1, HUES + 1), 1]
    module = (STATIC / "js/core/slots.js").read_text()
    assert f"HUES = {HUES};" in module
