"""Entities as JSON text, in each representation of NGSI-v2."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from iveg.lab.embedded.entities import (
    Attribute,
    Entity,
    Touched,
    Value,
    metadata_json,
)
from iveg.lab.embedded.orion_text import (
    date_json,
    quoted,
)

_BUILTIN = ("dateCreated", "dateModified", "alterationType")
_NOTIFIED = frozenset(("actionType", "previousValue"))
"""Metadata that exist only in notifications."""


@dataclass(frozen=True, slots=True)
class EntityView:
    """Requested representation.

    Attributes:
        form: ``normalized``, ``keyValues``, ``values`` or ``unique``.
        names: Attributes in the requested order; empty for all, by name.
        metadata: Metadata in the requested order; empty for all stored ones.
    """

    form: str = "normalized"
    names: tuple[str, ...] = ()
    metadata: tuple[str, ...] = ()

    @property
    def bare(self) -> bool:
        """Whether attributes are shown as plain values."""
        return self.form in ("keyValues", "simplifiedKeyValues")


def write_entity(
    entity: Entity,
    view: EntityView,
    foreign: Mapping[str, Attribute] | None = None,
    alteration: str = "",
) -> bytes:
    """JSON text of one entity.

    Args:
        entity: The entity.
        view: Its representation.
        foreign: Attributes of context providers, shown after the own ones.
        alteration: Kind of change, where metadata request it.
    """
    chosen = _chosen(entity, view, foreign or {}, alteration)
    if view.form in ("values", "unique"):
        return _values([attribute.json for _, attribute in chosen], view.form)
    parts = [b'"id":%b,"type":%b' % (quoted(entity.id), quoted(entity.type))]
    parts += _named(chosen, view)
    return b"{%b}" % b",".join(parts)


def annotated(
    entity: Entity, touched: Touched, wanted: Sequence[str], alteration: str
) -> Entity:
    """The entity with the metadata that only notifications have, where requested.

    ``actionType`` is ``append`` or ``update`` for attributes that the request named;
    ``previousValue`` is the value before the request, also for attributes it did not
    name, and is absent for a new entity.
    """
    if _NOTIFIED.isdisjoint(wanted):
        return entity
    previous = "previousValue" in wanted and alteration != "entityCreate"
    attributes = {}
    for name, one in entity.attributes.items():
        old = touched.before.get(name, None if name in touched.now else one)
        notes = {}
        if "actionType" in wanted and name in touched.now:
            notes["actionType"] = metadata_json("Text", "update" if old else "append")
        if previous and old is not None:
            notes["previousValue"] = b'{"type":%b,"value":%b}' % (
                quoted(old.type),
                old.json,
            )
        attributes[name] = one.noted(notes)
    return replace(entity, attributes=attributes)


def write_attributes(
    entity: Entity, view: EntityView, foreign: Mapping[str, Attribute] | None = None
) -> bytes:
    """The attributes of one entity, without its id and type."""
    chosen = _chosen(entity, view, foreign or {}, "")
    if view.form in ("values", "unique"):
        return _values([attribute.json for _, attribute in chosen], view.form)
    return b"{%b}" % b",".join(_named(chosen, view))


def _named(chosen: Sequence[tuple[str, Attribute]], view: EntityView) -> list[bytes]:
    if view.bare:
        return [quoted(name) + b":" + one.json for name, one in chosen]
    return [
        quoted(name) + b":" + one.normalized(() if name in _BUILTIN else view.metadata)
        for name, one in chosen
    ]


def _values(values: list[bytes], form: str) -> bytes:
    if form == "unique":
        values = list(dict.fromkeys(values))
    return b"[%b]" % b",".join(values)


def _chosen(
    entity: Entity, view: EntityView, foreign: Mapping[str, Attribute], alteration: str
) -> list[tuple[str, Attribute]]:
    own = entity.attributes
    if not view.names:
        return [(name, own[name]) for name in sorted(own)] + [
            (name, one) for name, one in foreign.items() if name not in own
        ]
    chosen: dict[str, Attribute] = {}
    for name in view.names:
        if name == "*":
            chosen.update((each, own[each]) for each in sorted(own))
        elif name in own:
            chosen[name] = own[name]
        elif name in foreign:
            chosen[name] = foreign[name]
    for name in ("dateCreated", "dateModified"):
        if name in view.names and name not in own:
            chosen[name] = _builtin_date(entity, name)
    if alteration and "alterationType" in view.names:
        chosen["alterationType"] = Attribute(
            "Text", Value(alteration), {}, entity.created, entity.modified
        )
    if "*" in view.names:
        return list(chosen.items())
    return [(name, chosen[name]) for name in view.names if name in chosen]


def _builtin_date(entity: Entity, name: str) -> Attribute:
    at = entity.created if name == "dateCreated" else entity.modified
    value = Value(json=date_json(at))
    return Attribute("DateTime", value, {}, entity.created, entity.modified)
