"""Prometheus' text format."""

from collections.abc import Iterable, Iterator


def family(
    name: str, kind: str, text: str, samples: Iterable[tuple[str, float | None]]
) -> Iterator[str]:
    """One family; samples that nobody knows are left out."""
    yield f"# HELP iveg_{name} {text}"
    yield f"# TYPE iveg_{name} {kind}"
    for labels, value in samples:
        if value is not None:
            yield f"iveg_{name}{labels} {number(value)}"


def number(value: float) -> str:
    """A value; true and false are 1 and 0."""
    return str(int(value) if isinstance(value, bool) else value)


def labels_of(**values: str) -> str:
    """The labels of a sample."""
    return "{" + ",".join(f'{name}="{value}"' for name, value in values.items()) + "}"
