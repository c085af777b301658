"""Entities as JSON text, in each representation of NGSI-v2."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from iveg.lab.embedded.entities import BUILTIN_DATES, Attribute, Entity, Value
from iveg.lab.embedded.orion_dates import date_json
from iveg.lab.embedded.orion_text import quoted

_NONE: Mapping[str, Attribute] = {}
_BARE = ("keyValues", "simplifiedKeyValues")
_BUILTIN = (*BUILTIN_DATES, "alterationType")


@dataclass(frozen=True, slots=True)
class EntityView:
    """Requested representation.

    Attributes:
        form: One of ``attrsFormat``, such as ``normalized`` or ``keyValues``.
        names: Attributes in the requested order; empty for all, by name.
        metadata: Metadata in the requested order; empty for all stored ones.
    """

    form: str = "normalized"
    names: tuple[str, ...] = ()
    metadata: tuple[str, ...] = ()


def write_entity(
    entity: Entity,
    view: EntityView,
    foreign: Mapping[str, Attribute] = _NONE,
    alteration: str = "",
) -> bytes:
    """JSON text of one entity.

    Args:
        entity: The entity.
        view: Its representation.
        foreign: Attributes of context providers, shown after the own ones.
        alteration: Kind of change, where attributes request it.
    """
    chosen = _chosen(entity, view, foreign, alteration)
    if view.form == "values":
        return b"[%b]" % b",".join([one.json for _, one in chosen])
    key = b'"id":%b,"type":%b' % (quoted(entity.id), quoted(entity.type))
    return b"{%b}" % b",".join((key, *_named(chosen, view)))


def _named(chosen: Sequence[tuple[str, Attribute]], view: EntityView) -> list[bytes]:
    if view.form in _BARE:
        return [quoted(name) + b":" + one.json for name, one in chosen]
    return [
        quoted(name) + b":" + one.normalized(() if name in _BUILTIN else view.metadata)
        for name, one in chosen
    ]


def _chosen(
    entity: Entity, view: EntityView, foreign: Mapping[str, Attribute], alteration: str
) -> list[tuple[str, Attribute]]:
    own = entity.attributes
    if not view.names:
        rest = [(name, one) for name, one in foreign.items() if name not in own]
        return sorted(own.items(), key=_name) + rest
    chosen: dict[str, Attribute] = {}
    for name in view.names:
        found = own.get(name) or foreign.get(name)
        if name == "*":
            chosen.update(sorted(own.items(), key=_name))
        elif found := found or _builtin(entity, name, alteration):
            chosen[name] = found
    return list(chosen.items())


def _name(item: tuple[str, Attribute]) -> str:
    return item[0]


def _builtin(entity: Entity, name: str, alteration: str) -> Attribute | None:
    """An attribute that every entity has and that is shown where it is requested."""
    created, modified = entity.created, entity.modified
    if name == "alterationType" and alteration:
        return Attribute("Text", Value(alteration), {}, created, modified)
    if name not in BUILTIN_DATES:
        return None
    value = Value(json=date_json(created if name == "dateCreated" else modified))
    return Attribute("DateTime", value, {}, created, modified)
