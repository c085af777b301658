"""NGSI-v2 over HTTP with Orion's paths, options, statuses and sentences."""

from collections.abc import Awaitable, Callable

import orjson

from iveg.adapters import clock
from iveg.lab.embedded import entity_paths, subscription_paths
from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.errors import FiwareError, bad_request
from iveg.lab.embedded.http_server import Request, Response
from iveg.lab.embedded.ngsi_request import NgsiCall, read_options
from iveg.lab.embedded.request_content import check_accept, check_content
from iveg.lab.embedded.request_scope import read_scope
from iveg.lab.embedded.routes import Routes

_Route = Callable[[ContextBroker, NgsiCall], Awaitable[Response]]


class NgsiApi:
    """Answers requests as Orion does.

    Args:
        broker: The context broker.
    """

    def __init__(self, broker: ContextBroker) -> None:
        self._broker = broker

    async def handle(self, request: Request) -> Response:
        """Answer one request."""
        correlator = request.headers.get("fiware-correlator", "")
        correlator = correlator or self._broker.outbox.correlator()
        try:
            response = await self._answer(request, correlator)
        except FiwareError as error:
            response = Response(error.status, error.body("error", "description"))
        if response.status == 405:
            # Orion lists the methods of a path in the order of its own table.
            response.headers["Allow"] = ", ".join(_ROUTES.of_path(request.parts))
        response.headers["Fiware-Correlator"] = correlator
        return response

    async def _answer(self, request: Request, correlator: str) -> Response:
        routes = _ROUTES.of_path(request.parts)
        if not routes:
            raise bad_request(
                "Service not found. Check your URL as probably it is wrong."
            )
        route = routes.get(request.method)
        if route is None:
            raise FiwareError("MethodNotAllowed", "method not allowed")
        check_content(request)
        check_accept(request)
        scope = read_scope(request, correlator, clock.wall())
        call = NgsiCall(request, scope, read_options(request), request.parts[1:])
        return await route(self._broker, call)


async def _version(broker: ContextBroker, call: NgsiCall) -> Response:
    up = int(call.scope.now - broker.started)
    uptime = f"{up // 86400} d, {up // 3600 % 24} h, {up // 60 % 60} m, {up % 60} s"
    about = {"version": "4.7.0-iveg-embedded", "uptime": uptime}
    return Response(200, orjson.dumps({"orion": about}))


_ROUTES: Routes[_Route] = Routes(
    {
        "GET /version": _version,
        "POST /v2/entities": entity_paths.create_entity,
        "GET /v2/entities": entity_paths.list_entities,
        "GET /v2/entities/*": entity_paths.get_entity,
        "DELETE /v2/entities/*": entity_paths.delete_entity,
        "PATCH /v2/entities/*/attrs": entity_paths.update_attributes,
        "DELETE /v2/entities/*/attrs/*": entity_paths.delete_attribute,
        "POST /v2/op/update": entity_paths.batch_update,
        "POST /v2/subscriptions": subscription_paths.create_subscription,
        "GET /v2/subscriptions": subscription_paths.list_subscriptions,
        "GET /v2/subscriptions/*": subscription_paths.get_subscription,
        "DELETE /v2/subscriptions/*": subscription_paths.delete_subscription,
        "PATCH /v2/subscriptions/*": subscription_paths.patch_subscription,
        "POST /v2/registrations": subscription_paths.create_registration,
        "GET /v2/registrations": subscription_paths.list_registrations,
        "DELETE /v2/registrations/*": subscription_paths.delete_registration,
    }
)
