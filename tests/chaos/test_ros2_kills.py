"""Gate, broker or iVeg die while a ROS 2 robot drives: its base halts in time.

Three kills in ``make test``; ``make chaos`` does a series, each line of which is in
``test-output/ros2-kills.jsonl``.
"""

import json
import os
from collections.abc import Iterator
from typing import Any

import pytest

from iveg.adapters.fleet_files import built_in
from iveg.lab.emulator.ros2_base import TIMEOUT_S
from tests.chaos.ros2_field import (
    ROBOT,
    SETTINGS,
    STAND_S,
    Ros2Field,
    Witness,
    ros2_field,
)
from tests.processes import ROOT, site, until

KILLS = int(os.environ.get("IVEG_CHAOS_KILLS", "3"))
VICTIMS = ("robot", "serve", "fiware")
LATE_S = 0.4
"""Two cores that many share: a tick of the base, of the gate and of the witness."""
WITHIN_S = {"robot": TIMEOUT_S, "serve": STAND_S, "fiware": STAND_S}
"""From the death of each to the first command to halt, or the base's own time-out."""


@pytest.fixture(scope="module")
def driven(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[tuple[Ros2Field, Witness]]:
    folder = tmp_path_factory.mktemp("ros2")
    with site(folder, **SETTINGS) as place, ros2_field(place) as found:
        yield found


@pytest.mark.slow
@pytest.mark.timeout(120 + 40 * KILLS)
def test_whoever_dies_the_base_halts_within_its_time_out(
    driven: tuple[Ros2Field, Witness],
) -> None:
    field, witness = driven
    lines: list[dict[str, Any]] = []
    folder = ROOT / "test-output"
    folder.mkdir(exist_ok=True)
    log = folder / "ros2-kills.jsonl"
    log.write_text("")
    for number in range(KILLS):
        victim = VICTIMS[number % len(VICTIMS)]
        field.drive(witness)
        died = field.kill(victim)
        stood = until(
            lambda died=died: witness.stood_after(died),  # type: ignore[misc]
            f"the base stands after {victim} died",
        )
        braking = witness.speed_at(died) / built_in().of_robot(ROBOT).profile.braking
        starved = witness.starved_s(died, died + stood)
        allowed = WITHIN_S[victim] + braking + LATE_S + starved
        lines.append(
            {
                "n": number,
                "victim": victim,
                "stood_s": round(stood, 3),
                "allowed_s": round(allowed, 3),
                "starved_s": round(starved, 3),
            }
        )
        # Line by line: a series that ends early has proven what it has done.
        with log.open("a") as out:
            out.write(json.dumps(lines[-1]) + "\n")

    late = [line for line in lines if line["stood_s"] > line["allowed_s"]]
    assert late == [], lines
