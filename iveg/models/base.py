"""Base of all models: frozen, only declared fields, encoded by orjson."""

import ast
from collections.abc import Iterator
from inspect import cleandoc, getsource
from itertools import pairwise
from textwrap import dedent
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import orjson
from pydantic import BaseModel, ConfigDict

from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp

Slots = dict[str, str | bool | int | float | None]
"""Values of the ``{named}`` placeholders of a sentence."""


def _describe(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """Add to a JSON schema the string below each field of the class.

    pydantic's own ``use_attribute_docstrings`` reads the source of each class when it
    is defined: a fifth of the start of iVeg, for a document that is seldom asked for.
    """
    members = schema.get("properties", {})
    for cls in reversed(model.__mro__):
        # Neither the bases of pydantic nor a generic that was given its type.
        if cls.__module__.startswith("iveg.") and "[" not in cls.__name__:
            for name, text in _described(cls):
                members.get(_key(model, name), {}).setdefault("description", text)


def _described(cls: type) -> Iterator[tuple[str, str]]:
    """The fields of a class that have a string below them, and the string."""
    (node,) = ast.parse(dedent(getsource(cls))).body
    for field, below in pairwise(getattr(node, "body", ())):
        match field, below:
            case ast.AnnAssign(target=ast.Name(name)), ast.Expr(
                ast.Constant(str(text))
            ):
                yield name, cleandoc(text)


def _key(model: type[BaseModel], name: str) -> str:
    field = model.model_fields.get(name)
    return (field and (field.serialization_alias or field.alias)) or name


class Model(BaseModel):
    """Base of all resources; lengths in metres, angles in radians, ages in seconds.

    What iVeg makes itself is typed by mypy and not validated again: twenty robots are
    some 2,000 models a second.  ``model_validate`` validates, and the tests do.
    """

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        serialize_by_alias=True,
        json_schema_extra=_describe,
    )
    _defaults: ClassVar[dict[str, Any]] = {}

    def __eq__(self, other: object) -> bool:
        """Field by field; pydantic's own takes three times as long, 2,000 a second."""
        return type(self) is type(other) and self.__dict__ == other.__dict__

    def __reduce__(self) -> tuple[Any, ...]:
        """For another process: its fields, as pydantic's own state is not made."""
        return _made, (type(self), self.__dict__)

    __hash__ = None  # type: ignore[assignment]

    if not TYPE_CHECKING:

        def __init__(self, /, **fields: Any) -> None:
            """Field by field, all that have no default."""
            object.__setattr__(self, "__dict__", self._defaults | fields)

        __init__.__pydantic_base_init__ = True  # so that validation does not call it

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Look defaults up once; none of them is a thing that can be changed."""
        known = cls.model_fields.items()
        cls._defaults = {n: f.default for n, f in known if not f.is_required()}


def _made(model: type[Model], fields: dict[str, Any]) -> Model:
    return model(**fields)


M = TypeVar("M", bound=Model)


class Listing(Model, Generic[M]):
    """One page of a list; ``next`` is the cursor of the page after it."""

    items: list[M]
    next: str | None = None


def write_json(value: Any) -> bytes:
    """Models, and whatever holds them, as JSON."""
    return orjson.dumps(value, default=_plain)


def _plain(value: object) -> Any:
    if isinstance(value, Model):
        return orjson.Fragment(value.__pydantic_serializer__.to_json(value))
    raise TypeError(type(value).__name__)


def moment(at: Instant | None) -> str | None:
    """An instant as ISO-8601 UTC with milliseconds."""
    return None if at is None else format_stamp(at.wall)


def stamp(wall: float | None) -> str | None:
    """Unix seconds as ISO-8601 UTC with milliseconds."""
    return None if wall is None else format_stamp(wall)


def rounded(value: float | None, digits: int = 3) -> float | None:
    """A number with no more decimals than it can mean."""
    return None if value is None else round(value, digits)
