"""Real robots behind a radio that is late (F11) or loses and resets (F12).

A thousand of each are run on the virtual clock in ``properties/test_stop_network``;
these few prove that the real sockets behave as it says.
"""

import os
import time
from collections.abc import Iterator

import pytest

from tests.chaos.field import Field, running
from tests.chaos.person import Person
from tests.chaos.radio import FAIR, LATE, LOSSY, Radio, Weather
from tests.chaos.witness import Witness
from tests.processes import Site, until

TIMES = int(os.environ.get("IVEG_CHAOS_TIMES", "1"))
pytestmark = [pytest.mark.slow, pytest.mark.timeout(240 + 30 * TIMES)]
STOPS = 3
"""Of which one loses its first try, and the one in the middle is no exception."""


@pytest.fixture(scope="module")
def stack(place: Site, radio: Radio) -> Iterator[Field]:
    """The robots are on the radio."""
    with running(place, radio.port) as found:
        yield found


@pytest.fixture(scope="module")
def radio(place: Site) -> Iterator[Radio]:
    with Radio(Field(place).port) as found:
        yield found


@pytest.fixture(autouse=True)
def fair_weather_after(radio: Radio) -> Iterator[None]:
    yield
    radio.weather = FAIR


def stop_through(
    weather: Weather, radio: Radio, person: Person, witness: Witness
) -> tuple[float, int]:
    """Stop a robot that drives in this weather; seconds to STANDING, and tries."""
    robot = witness.of("AGI")
    radio.weather = FAIR
    person.let_go("AGI")
    radio.weather = weather
    until(lambda: robot.factor <= 0.5 and robot.speed > 0.1, "it slows")

    began = time.monotonic()
    until(lambda: person.press("AGI"), "STOP is accepted")
    person.wait_for("AGI", "STANDING")
    took = time.monotonic() - began

    told = person.look("AGI")
    assert told is not None
    words = robot.words
    # Ten reports later the witness has seen what had been under way meanwhile.  Until
    # STOP reaches it a slow robot may stand and start; held, it starts no more.
    until(lambda: robot.words > words + 10, "more reports")
    assert robot.held
    assert witness.unlicensed == 0, "it moved after it had stood, held"
    assert robot.speed < 0.02
    return took, int(told["stop"]["tries"])


def test_f11_half_a_second_of_latency_slows_robots_and_fakes_no_standstill(
    radio: Radio, stack: Field, person: Person, witness: Witness
) -> None:
    for _ in range(TIMES):
        stop_through(LATE, radio, person, witness)

    assert stack.radio == radio.port
    assert witness.unlicensed == 0


def test_f12_loss_and_resets_leave_a_stop_that_stands_and_tells_its_tries(
    radio: Radio, stack: Field, person: Person, witness: Witness
) -> None:
    told = [stop_through(LOSSY, radio, person, witness) for _ in range(STOPS)]

    assert stack.radio == radio.port
    assert radio.resets > 0
    assert all(tries >= 1 for _, tries in told)
    assert max(tries for _, tries in told) > 1
    assert sorted(took for took, _ in told)[STOPS // 2] <= 10.0
    assert witness.unlicensed == 0
