"""The whole stack on a real Mosquitto, with a witness and a person."""

from collections.abc import Iterator

import pytest

from tests.brokers import MOSQUITTO
from tests.chaos.field import Field, running
from tests.chaos.person import Person
from tests.chaos.witness import Witness
from tests.processes import Site, site

if MOSQUITTO is None:
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    with site(tmp_path_factory.mktemp("chaos")) as found:
        yield found


@pytest.fixture(scope="module")
def stack(place: Site) -> Iterator[Field]:
    with running(place) as found:
        yield found


@pytest.fixture(scope="module")
def witness(stack: Field) -> Iterator[Witness]:
    with Witness(stack.port) as found:
        yield found


@pytest.fixture(scope="module")
def person(stack: Field, witness: Witness) -> Iterator[Person]:
    found = Person(stack.place, witness)
    yield found
    found.close()
