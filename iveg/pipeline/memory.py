"""What a pipeline remembers, as bytes that another of the same build can take over.

The parts stay where they are, so that every wire between them holds; what they have in
mind is put in its place.  Which attributes are wires (calls, ports, what never changes)
is seen once, when nothing has come in yet.
"""

import io
import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from enum import Enum
from operator import attrgetter
from typing import Any, Final

from iveg.domain.errors import UnreadableError
from iveg.domain.fleet import FleetDescription
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import LaserScan, UnreadScan
from iveg.domain.stop.machine import STEPS
from iveg.domain.witness import Plan
from iveg.pipeline.parts import Pipeline

_CONSTANTS = Greenhouse, FleetDescription, Plan
_OURS = "iveg.domain.", "iveg.pipeline."
_LEFT_OUT = (
    *("hub", "latency", "commander._sender", "shadow"),
    *("evaluator.tracking.newest", "evaluator.tracking.kept"),
    "evaluator._speed_limits._zones",
)
"""Parts that no picture of the world needs."""
_TASKS = "_tasks"
_PIECE: Final = 100
"""Frozen values that are written at a time: a millisecond or two."""
_PLAIN: Final = {
    "builtins": {"bool", "dict", "float", "frozenset", "int", "list", "set", "str"},
    "collections": {"deque", "defaultdict", "Counter", "OrderedDict"},
    "numpy": {"ndarray", "dtype"},
    "numpy._core.multiarray": {"_reconstruct", "scalar"},
    "numpy._core.numeric": {"_frombuffer"},
    "_codecs": {"encode"},
}


class Memory:
    """The memory of one pipeline.

    Args:
        parts: Just built; nothing has come in.
    """

    def __init__(self, parts: Pipeline) -> None:
        self._wired: dict[str, object] = {}
        """Parts and constants by their path, which is the same in each pipeline."""
        self._kept: dict[str, list[str]] = {}
        """Attributes of a part that are no wires, by its path."""
        self._paths: dict[int, str] = {}
        self._robots = set(parts.world.robots)
        self._scans = parts.scans
        for state, key in STEPS:
            self._wire(f"stop.{state}.{key}", STEPS[state, key])
        for name in parts.__dataclass_fields__:
            self._find(name, getattr(parts, name))

    def write(self) -> Iterator[bytes]:
        """As it is now, in pieces, between which anything may happen.

        What may change is written at once, and of frozen values no more than their
        numbers; they themselves are written piece by piece.
        """
        states = {
            path: {name: getattr(self._wired[path], name) for name in names}
            for path, names in self._kept.items()
        }
        values: list[object] = []
        writer = _Writer(self._wired.values(), self._paths, self._scans.as_read, values)
        return self._pieces(values, writer.written(states))

    def _pieces(self, values: Sequence[object], states: bytes) -> Iterator[bytes]:
        parts = [values[i : i + _PIECE] for i in range(0, len(values), _PIECE)]
        writer = _Writer(self._wired.values(), self._paths, self._scans.as_read)
        yield writer.written(len(parts))
        yield from map(writer.written, parts)
        yield states

    def read(self, data: bytes) -> None:
        """Take over what :meth:`write` gave.

        Raises:
            UnreadableError: it is of another build, or nothing of the kind.
        """
        try:
            stream, values = io.BytesIO(data), list[object]()
            reader = _Reader(stream, self._wired, values)
            for _ in range(reader.load()):
                values += reader.load()
            states = _Reader(stream, self._wired, values).load()
            if states["world"]["robots"].keys() != self._robots:
                raise LookupError("recorded with other robots")
            for path, state in states.items():
                for name in self._kept[path]:
                    setattr(self._wired[path], name, state[name])
        except Exception as error:
            raise UnreadableError("memory", repr(error)) from error

    def _find(self, path: str, value: object) -> None:
        if id(value) in self._paths:
            return
        self._wire(path, value)
        if isinstance(value, _CONSTANTS) or path in _LEFT_OUT:
            return
        kept = self._kept[path] = []
        for name in _attributes(value):
            one = getattr(value, name)
            if _is_part(one):
                self._find(f"{path}.{name}", one)
            elif name != _TASKS and not _is_wire(one):
                kept.append(name)

    def _wire(self, path: str, value: object) -> None:
        self._paths[id(value)], self._wired[path] = path, value


def _attributes(value: object) -> Iterator[str]:
    yield from getattr(value, "__dict__", ())
    for base in type(value).__mro__:
        for name in base.__dict__.get("__slots__", ()):
            if hasattr(value, name):
                yield name


def _is_part(value: object) -> bool:
    """Whether it is one of the parts that are wired, and not what one of them knows."""
    if isinstance(value, _CONSTANTS):
        return True
    of = type(value)
    if (
        not of.__module__.startswith(_OURS)
        or callable(value)
        or isinstance(value, Enum)
    ):
        return False
    params = getattr(of, "__dataclass_params__", None)
    return params is None or not params.frozen


def _is_wire(value: object) -> bool:
    if isinstance(value, Mapping):
        return any(map(_is_wire, value.values()))
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        return any(map(_is_wire, list(value)))
    is_call = callable(value) and not isinstance(value, type)
    return is_call or not _is_data(value)


def _is_data(value: object) -> bool:
    module = type(value).__module__
    return module.startswith((*_OURS, "builtins", "collections", "numpy"))


class _Writer(pickle.Pickler):
    """Writes values, each once, and of parts only where they are.

    Args:
        values: Takes frozen values, of which only the numbers are written then.
    """

    def __init__(
        self,
        wired: Iterable[object],
        paths: Mapping[int, str],
        as_read: Callable[[UnreadScan], LaserScan | None],
        values: list[object] | None = None,
    ) -> None:
        self._stream = io.BytesIO()
        super().__init__(self._stream, protocol=5)

        def place(value: object) -> tuple[Any, ...]:
            path = paths.get(id(value))
            if path is not None:
                return _at, (path,)
            reduced: tuple[Any, ...] = value.__reduce_ex__(5)  # type: ignore[assignment]
            return reduced

        # By type, and not by asking of each value, which takes five times as long.
        reducers = _Reducers({type(one): place for one in wired})
        self.dispatch_table = (
            reducers if values is None else _Numbered(reducers, values)
        )
        # Whoever compares scans by identity must find the same one in all places.
        self.dispatch_table[UnreadScan] = lambda scan: (_same, (as_read(scan),))

    def written(self, value: object) -> bytes:
        """One value; those that were written before are not written again."""
        self._stream.seek(0)
        self._stream.truncate()
        self.dump(value)
        return self._stream.getvalue()


class _Reducers(dict[type, Callable[[Any], tuple[Any, ...]]]):
    """How values of each type are written.

    Frozen dataclasses with slots are as the library writes them, which asks for the
    names of their fields each time, and takes twice as long in all.
    """

    def __missing__(self, of: type) -> Callable[[Any], tuple[Any, ...]]:
        first, *more = _state_of(of) or (None,)
        if first is None or not more:
            # Of one name ``attrgetter`` makes no tuple.
            raise KeyError(of)
        values, made = attrgetter(first, *more), (of,)
        reduced = self[of] = lambda one: (_NEW, made, list(values(one)))
        return reduced


class _Numbered(_Reducers):
    """Of frozen values the numbers alone; they are put into ``values``."""

    def __init__(self, reducers: _Reducers, values: list[object]) -> None:
        super().__init__(reducers)
        self._values = values

    def __missing__(self, of: type) -> Callable[[Any], tuple[Any, ...]]:
        if not _state_of(of):
            raise KeyError(of)
        values = self._values

        def number(one: object) -> tuple[Any, ...]:
            values.append(one)
            return _value, (len(values) - 1,)

        self[of] = number
        return number


_NEW: Final = object().__reduce_ex__(2)[0]
"""Makes a value of which the state follows."""


def _state_of(of: type) -> Sequence[str]:
    """The fields that ``dataclasses`` takes for all that a value is; else none."""
    params = getattr(of, "__dataclass_params__", None)
    is_plain = params is not None and params.frozen and "__slots__" in of.__dict__
    return [one.name for one in fields(of)] if is_plain else []


def _at(path: str) -> object:
    """Stands in a file for a part; the reader knows it."""
    raise LookupError(path)


def _value(number: int) -> object:
    """Stands for a frozen value; the reader has it."""
    raise LookupError(number)


def _same(scan: LaserScan | None) -> LaserScan | None:
    return scan


class _Reader(pickle.Unpickler):
    """Makes nothing but values of ours: a file may come from anywhere."""

    def __init__(
        self,
        stream: io.BytesIO,
        wired: Mapping[str, object],
        values: Sequence[object],
    ) -> None:
        super().__init__(stream)
        self._own = {
            _at.__name__: wired.__getitem__,
            _value.__name__: values.__getitem__,
            _same.__name__: _same,
        }

    def find_class(self, module: str, name: str) -> Any:
        if module == __name__ and name in self._own:
            return self._own[name]
        found = super().find_class(module, name)
        # By where it is from: a module of ours holds what it imports, too.
        is_ours = isinstance(found, type) and found.__module__.startswith(_OURS)
        if is_ours or name in _PLAIN.get(module, ()):
            return found
        raise pickle.UnpicklingError(f"{module}.{name}")
