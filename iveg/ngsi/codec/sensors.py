"""Values of small sensors, both ways, from what their observations declare."""

from collections.abc import Mapping
from typing import Annotated, Any, get_type_hints

from pydantic import Field, create_model

from iveg.domain.kinds import SENSED, Kind
from iveg.domain.observations import Observation
from iveg.domain.quantities import Quantity, quantities_of
from iveg.ngsi.codec.fields import read_origin
from iveg.ngsi.payloads import OriginFields


def _value_of(of: type[Observation]) -> type[OriginFields]:
    """The object on the wire: the origin, and each quantity within its bounds."""
    types = get_type_hints(of)
    members: dict[str, Any] = {
        name: (Annotated[types[name], _bounds(quantity)], None)
        for name, quantity in quantities_of(of).items()
    }
    return create_model(f"{of.__name__}Value", __base__=OriginFields, **members)


def _bounds(quantity: Quantity) -> object:
    return Field(ge=quantity.least, le=quantity.most)


_VALUES = {kind.of: _value_of(kind.of) for kind in SENSED}


def read_sensed(
    kind: Kind, robot_id: str, attributes: Mapping[str, object]
) -> Observation:
    """Read a small sensor's attribute, which has its name."""
    value = _VALUES[kind.of].model_validate(attributes[kind.name])
    said = {name: getattr(value, name) for name in quantities_of(kind.of)}
    return kind.of(robot_id, read_origin(value), **said)
