"""The tour is true: one detection and one STOP pass every function that it names."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from tests.architecture.test_tour import STEPS
from tests.processes import EMULATOR, Site, site, until

PYTHON = [(path, name) for path, name in STEPS if path.endswith(".py")]


@pytest.fixture(scope="module")
def passed(tmp_path_factory: pytest.TempPathFactory) -> set[tuple[str, str]]:
    """Functions that the three programs of a stack passed, by file."""
    folder = tmp_path_factory.mktemp("tour")
    with site(folder) as place:
        for words in (("fiware",), ("serve",), (*EMULATOR, "--seed", "3")):
            place.start(*words, module="tests.integration.passed")
            if words == ("serve",):
                place.wait_until_served()
        place.wait_until_live()
        _slow_down_and_stop(place)
        for program in reversed(place.programs):
            assert program.interrupt() == 0
    return set(_read(folder))


def _slow_down_and_stop(place: Site) -> None:
    headers = {"Authorization": f"Bearer {place.settings['IVEG_API_TOKEN']}"}
    live = place.url.replace("http", "ws") + "/live"
    with (
        place.api() as api,
        connect(
            live,
            subprotocols=[Subprotocol("iveg.2")],
            additional_headers=headers,
            proxy=None,
        ) as page,
    ):
        page.recv(timeout=30.0)

        def is_obeyed() -> bool:
            answer = api.get("decisions", params={"limit": 20}).json()
            return any(one["observed_at"] for one in answer["items"])

        until(is_obeyed, "a slow-down that was obeyed")
        api.post("robots/AGI/stop", json={}).raise_for_status()

        def stands() -> bool:
            return bool(api.get("robots/AGI").json()["stop_state"] == "STANDING")

        until(stands, "AGI stands")


def _read(folder: Path) -> Iterator[tuple[str, str]]:
    files = list(folder.glob("passed-*.json"))
    assert len(files) == 3
    for file in files:
        for path, name in json.loads(file.read_text()):
            yield path, name
            # With a method its class is passed, and with an inner function the outer.
            yield path, name.partition(".")[0]


@pytest.mark.parametrize(("path", "name"), PYTHON, ids=lambda one: str(one))
def test_the_tour_passes(path: str, name: str, passed: set[tuple[str, str]]) -> None:
    assert (path, name) in passed


def test_what_is_on_neither_way_is_not_passed(passed: set[tuple[str, str]]) -> None:
    assert ("iveg/pipeline/command.py", "Commander.stop") in passed
    assert ("iveg/pipeline/command.py", "Commander.release") not in passed
