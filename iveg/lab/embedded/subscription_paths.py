"""``/v2/subscriptions`` and ``/v2/registrations``."""

from typing import Any

from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.http_server import Response, json_response
from iveg.lab.embedded.ngsi_request import Call, paging
from iveg.lab.embedded.orion_text import NgsiError, bad_request, not_found
from iveg.lab.embedded.registrations import Registration, read_registration
from iveg.lab.embedded.subscriptions import (
    Subscription,
    read_subscription,
    update_subscription,
)


async def list_subscriptions(broker: ContextBroker, call: Call) -> Response:
    """``GET /v2/subscriptions``."""
    known = broker.tenant(call.scope.service).subscriptions.values()
    return _page(call, [one.show(call.scope.now) for one in known])


async def create_subscription(broker: ContextBroker, call: Call) -> Response:
    """``POST /v2/subscriptions``."""
    made = read_subscription(call.json(), call.scope.service, call.scope.path)
    broker.subscribe(made)
    return Response(201, headers={"Location": f"/v2/subscriptions/{made.id}"})


async def get_subscription(broker: ContextBroker, call: Call) -> Response:
    """``GET /v2/subscriptions/{id}``."""
    return json_response(_subscription(broker, call).show(call.scope.now))


async def patch_subscription(broker: ContextBroker, call: Call) -> Response:
    """``PATCH /v2/subscriptions/{id}``."""
    known = _subscription(broker, call, "subscription id not found")
    update_subscription(known, call.json())
    broker.tenant(known.service).forget_concerned()
    return Response(204)


async def delete_subscription(broker: ContextBroker, call: Call) -> Response:
    """``DELETE /v2/subscriptions/{id}``."""
    broker.unsubscribe(_subscription(broker, call))
    return Response(204)


def _subscription(
    broker: ContextBroker,
    call: Call,
    unknown: str = "The requested subscription has not been found. Check id",
) -> Subscription:
    wanted = call.parts[1]
    if len(wanted) != 24:
        raise bad_request("Invalid subscription ID: bad length - 24 chars expected")
    known = broker.tenant(call.scope.service).subscriptions.get(wanted)
    if known is None:
        raise not_found(unknown)
    return known


async def list_registrations(broker: ContextBroker, call: Call) -> Response:
    """``GET /v2/registrations``."""
    known = _registrations(broker, call).values()
    return _page(call, [one.show() for one in known])


async def create_registration(broker: ContextBroker, call: Call) -> Response:
    """``POST /v2/registrations``."""
    made = read_registration(call.json(), call.scope.path)
    _registrations(broker, call)[made.id] = made
    return Response(201, headers={"Location": f"/v2/registrations/{made.id}"})


async def get_registration(broker: ContextBroker, call: Call) -> Response:
    """``GET /v2/registrations/{id}``."""
    known = _registrations(broker, call).get(call.parts[1])
    if known is None:
        raise _no_registration()
    return json_response(known.show())


async def delete_registration(broker: ContextBroker, call: Call) -> Response:
    """``DELETE /v2/registrations/{id}``."""
    if _registrations(broker, call).pop(call.parts[1], None) is None:
        raise _no_registration()
    return Response(204)


def _registrations(broker: ContextBroker, call: Call) -> dict[str, Registration]:
    return broker.tenant(call.scope.service).registrations


def _no_registration() -> NgsiError:
    return not_found("The requested registration has not been found. Check id")


def _page(call: Call, shown: list[Any]) -> Response:
    limit, offset = paging(call.request.query)
    response = json_response(shown[offset : offset + limit])
    if "count" in call.options:
        response.headers["Fiware-Total-Count"] = str(len(shown))
    return response
