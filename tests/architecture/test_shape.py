"""The project gets no larger than ``shape.toml`` says."""

from benchmarks.shape import counted, limits


def test_no_number_is_larger_than_its_limit() -> None:
    numbers, most = counted(), limits()

    assert {k: (n, most[k]) for k, n in numbers.items() if n > most[k]} == {}
    assert numbers.keys() == most.keys()
