"""Every seeded mistake of ``make mutants`` still has its place in the code."""

import pytest

from tests.mutants import MUTANTS, Mutant
from tests.processes import ROOT


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.says)
def test_the_text_of_every_mutant_is_in_the_code(mutant: Mutant) -> None:
    assert mutant.file.suffix == ".py"
    assert [one for one in mutant.tests if not (ROOT / "tests" / one).exists()] == []
    assert mutant.right != mutant.wrong
