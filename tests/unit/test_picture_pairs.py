"""The choice of pictures that ``make pictures`` takes."""

from itertools import combinations, product

from tests.pictures.pairs import covering

FACTORS = {"page": "abcdefg", "width": "wxyz", "theme": "lds", "language": "eE"}


def test_every_pair_of_values_is_in_a_case_and_few_cases_do() -> None:
    found = covering(FACTORS)

    wanted = {
        frozenset({(one, a), (other, b)})
        for one, other in combinations(FACTORS, 2)
        for a, b in product(FACTORS[one], FACTORS[other])
    }
    shown = {
        frozenset(pair) for case in found for pair in combinations(case.items(), 2)
    }
    assert shown == wanted
    assert len(found) <= 1.2 * len(FACTORS["page"]) * len(FACTORS["width"])


def test_further_cases_are_new_ones_and_each_value_has_its_share() -> None:
    found = covering(FACTORS, at_least=84)

    assert len({tuple(case.values()) for case in found}) == len(found) == 84
    themes = [case["theme"] for case in found]
    assert {themes.count(theme) for theme in "lds"} <= {26, 27, 28, 29, 30}
