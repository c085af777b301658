"""Routes of the embedded HTTP server: a method and a path of parts."""

from collections.abc import Mapping
from typing import Generic, TypeVar

_Route = TypeVar("_Route")


class Routes(Generic[_Route]):
    """A table of routes.

    Args:
        table: By method and path, such as ``GET /v2/entities/*``.
    """

    def __init__(self, table: Mapping[str, _Route]) -> None:
        self._table = []
        for line, route in table.items():
            method, *shape = line.replace("/", " ").split()
            self._table.append((shape, method, route))

    def of_path(self, parts: tuple[str, ...]) -> dict[str, _Route]:
        """Methods of a path with their routes, in the order of the table."""
        return {
            method: route
            for shape, method, route in self._table
            if len(shape) == len(parts)
            and all(one in ("*", part) for one, part in zip(shape, parts, strict=True))
        }
