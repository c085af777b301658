"""Nothing of the proof is lost when tests change: facts, examples, mutants."""

import pytest

from tests.mutants import MUTANTS, Mutant
from tests.proofs import TESTS, counted, kept


@pytest.mark.parametrize("section", ["facts", "properties", "repeats"])
def test_no_number_of_the_proof_has_fallen(section: str) -> None:
    now = counted()[section]

    fallen = {
        name: (number, now.get(name, 0))
        for name, number in kept()[section].items()
        if now.get(name, 0) < number
    }

    assert fallen == {}


def test_every_invariant_is_named_by_a_test() -> None:
    last = {"R": 10, "I": 12, "L": 2}
    wanted = {f"{kind}{n}" for kind in last for n in range(1, last[kind] + 1)}

    assert wanted - set(counted()["facts"]) == set()


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.says)
def test_the_text_of_every_mutant_is_in_the_code(mutant: Mutant) -> None:
    assert mutant.file.suffix == ".py"
    assert [one for one in mutant.tests if not (TESTS / one).exists()] == []
    assert mutant.right != mutant.wrong


def test_stop_the_rule_freshness_clear_and_what_is_vital_have_mutants() -> None:
    assert len(MUTANTS) >= 10
    assert {mutant.says.partition(":")[0] for mutant in MUTANTS} == {
        "STOP",
        "rule",
        "freshness",
        "clear",
        "vital",
    }
