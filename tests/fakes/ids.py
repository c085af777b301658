"""Ids that count: never the same twice, and easy to read in a failure."""


class FakeIds:
    """Implements ``vital.ports.Ids``."""

    def __init__(self) -> None:
        self.given: list[str] = []

    def __call__(self) -> str:
        self.given.append(f"ID{len(self.given) + 1:04d}")
        return self.given[-1]
