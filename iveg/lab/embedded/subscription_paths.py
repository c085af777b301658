"""``/v2/subscriptions`` and ``/v2/registrations``."""

import orjson

from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.errors import bad_request, not_found
from iveg.lab.embedded.http_server import Response
from iveg.lab.embedded.ngsi_request import NgsiCall
from iveg.lab.embedded.orion_text import load_json
from iveg.lab.embedded.registrations import read_registration
from iveg.lab.embedded.subscriptions import Subscription, read_subscription

_NO_SUBSCRIPTION = "The requested subscription has not been found. Check id"


async def list_subscriptions(broker: ContextBroker, call: NgsiCall) -> Response:
    """``GET /v2/subscriptions``."""
    known = broker.tenant(call.scope.service).subscriptions.values()
    return call.page(
        [orjson.dumps(one.show(call.scope.now)) for one in known], len(known)
    )


async def create_subscription(broker: ContextBroker, call: NgsiCall) -> Response:
    """``POST /v2/subscriptions``."""
    raw = load_json(call.request.body)
    made = read_subscription(raw, call.scope.service, call.scope.path)
    broker.subscribe(made)
    return Response(201, headers={"Location": f"/v2/subscriptions/{made.id}"})


async def get_subscription(broker: ContextBroker, call: NgsiCall) -> Response:
    """``GET /v2/subscriptions/{id}``."""
    known = _subscription(broker, call)
    return Response(200, orjson.dumps(known.show(call.scope.now)))


async def patch_subscription(broker: ContextBroker, call: NgsiCall) -> Response:
    """``PATCH /v2/subscriptions/{id}``."""
    known = _subscription(broker, call, "subscription id not found")
    known.change(load_json(call.request.body))
    broker.tenant(known.service).forget_concerned()
    return Response(204)


async def delete_subscription(broker: ContextBroker, call: NgsiCall) -> Response:
    """``DELETE /v2/subscriptions/{id}``."""
    broker.unsubscribe(_subscription(broker, call))
    return Response(204)


def _subscription(
    broker: ContextBroker, call: NgsiCall, unknown: str = _NO_SUBSCRIPTION
) -> Subscription:
    wanted = call.parts[1]
    if len(wanted) != 24:
        raise bad_request("Invalid subscription ID: bad length - 24 chars expected")
    known = broker.tenant(call.scope.service).subscriptions.get(wanted)
    if known is None:
        raise not_found(unknown)
    return known


async def list_registrations(broker: ContextBroker, call: NgsiCall) -> Response:
    """``GET /v2/registrations``."""
    known = broker.tenant(call.scope.service).registrations.values()
    return call.page([orjson.dumps(one.show()) for one in known], len(known))


async def create_registration(broker: ContextBroker, call: NgsiCall) -> Response:
    """``POST /v2/registrations``."""
    made = read_registration(load_json(call.request.body), call.scope.path)
    broker.tenant(call.scope.service).registrations[made.id] = made
    return Response(201, headers={"Location": f"/v2/registrations/{made.id}"})


async def delete_registration(broker: ContextBroker, call: NgsiCall) -> Response:
    """``DELETE /v2/registrations/{id}``."""
    known = broker.tenant(call.scope.service).registrations
    if known.pop(call.parts[1], None) is None:
        raise not_found("The requested registration has not been found. Check id")
    return Response(204)
