"""NGSI-v2 over HTTP with Orion's paths, options, statuses and sentences."""

from collections.abc import Awaitable, Callable

from iveg.adapters import clock
from iveg.lab.embedded import (
    batch_path,
    entity_paths,
    subscription_paths,
)
from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.http_server import Request, Response, json_response
from iveg.lab.embedded.ngsi_request import (
    Call,
    check_accept,
    check_body,
    check_size,
    read_options,
    scope,
)
from iveg.lab.embedded.orion_text import (
    NgsiError,
    bad_request,
)

_URLS = {
    "entities_url": "/v2/entities",
    "types_url": "/v2/types",
    "subscriptions_url": "/v2/subscriptions",
    "registrations_url": "/v2/registrations",
}
_Route = Callable[[ContextBroker, Call], Awaitable[Response]]


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
        except NgsiError as error:
            response = Response(error.status, error.body)
            if error.allow:
                response.headers["Allow"] = error.allow
            if request.headers.get("accept") == "text/plain":
                response = Response(
                    error.status, error.body, response.headers, "text/plain"
                )
        response.headers["Fiware-Correlator"] = correlator
        return response

    async def _answer(self, request: Request, correlator: str) -> Response:
        check_size(request)
        parts = tuple(part for part in request.path.split("/") if part)
        routes = _routes_of(parts)
        route = routes.get(request.method)
        if route is None:
            # Orion lists the methods of a path in the order of its own table.
            raise NgsiError(
                405, "MethodNotAllowed", "method not allowed", ", ".join(routes)
            )
        check_body(request)
        check_accept(request)
        whose = scope(request, correlator, clock.wall())
        options = read_options(request)
        return await route(self._broker, Call(request, whose, options, parts[1:]))


async def _version(broker: ContextBroker, call: Call) -> Response:
    up = int(call.scope.now - broker.started)
    uptime = f"{up // 86400} d, {up // 3600 % 24} h, {up // 60 % 60} m, {up % 60} s"
    about = {"version": "4.7.0-iveg-embedded", "uptime": uptime}
    return json_response({"orion": about})


async def _urls(_: ContextBroker, __: Call) -> Response:
    return json_response(_URLS)


_TABLE: tuple[tuple[tuple[str, ...], dict[str, _Route]], ...] = (
    (("version",), {"GET": _version}),
    (("v2",), {"GET": _urls}),
    (
        ("v2", "entities"),
        {"POST": entity_paths.create_entity, "GET": entity_paths.list_entities},
    ),
    (
        ("v2", "entities", "*"),
        {"GET": entity_paths.get_entity, "DELETE": entity_paths.delete_entity},
    ),
    (
        ("v2", "entities", "*", "attrs"),
        {
            "GET": entity_paths.get_attributes,
            "PUT": entity_paths.replace_attributes,
            "POST": entity_paths.append_attributes,
            "PATCH": entity_paths.update_attributes,
        },
    ),
    (
        ("v2", "entities", "*", "attrs", "*"),
        {
            "GET": entity_paths.get_attribute,
            "PUT": entity_paths.put_attribute,
            "DELETE": entity_paths.delete_attribute,
        },
    ),
    (
        ("v2", "entities", "*", "attrs", "*", "value"),
        {"GET": entity_paths.get_value, "PUT": entity_paths.put_value},
    ),
    (("v2", "op", "update"), {"POST": batch_path.batch_update}),
    (
        ("v2", "subscriptions"),
        {
            "POST": subscription_paths.create_subscription,
            "GET": subscription_paths.list_subscriptions,
        },
    ),
    (
        ("v2", "subscriptions", "*"),
        {
            "GET": subscription_paths.get_subscription,
            "DELETE": subscription_paths.delete_subscription,
            "PATCH": subscription_paths.patch_subscription,
        },
    ),
    (
        ("v2", "registrations"),
        {
            "POST": subscription_paths.create_registration,
            "GET": subscription_paths.list_registrations,
        },
    ),
    (
        ("v2", "registrations", "*"),
        {
            "GET": subscription_paths.get_registration,
            "DELETE": subscription_paths.delete_registration,
        },
    ),
)


def _routes_of(parts: tuple[str, ...]) -> dict[str, _Route]:
    for shape, routes in _TABLE:
        if len(shape) == len(parts) and all(
            one in ("*", part) for one, part in zip(shape, parts, strict=True)
        ):
            return routes
    raise bad_request("Service not found. Check your URL as probably it is wrong.")
