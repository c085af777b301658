"""North port of the agent: groups, devices, and requests of the context broker."""

from collections.abc import Awaitable, Callable, Mapping, Sequence

import orjson

from iveg.lab.embedded.devices import AgentDevice, Group, Tenancy, read_group
from iveg.lab.embedded.errors import FiwareError, wrong_syntax
from iveg.lab.embedded.http_server import Request, Response
from iveg.lab.embedded.iot_agent import IotAgent
from iveg.lab.embedded.routes import Routes

_ABOUT = {
    "libVersion": "4.14.0-iveg-embedded",
    "baseRoot": "/",
    "version": "3.14.0-iveg-embedded",
}
_JSON = "application/json; charset=utf-8"
_Route = Callable[["IotaApi", Request], Awaitable[Response]]


class IotaApi:
    """Answers requests as the IoT Agent does.

    Args:
        agent: Executes them.
    """

    def __init__(self, agent: IotAgent) -> None:
        self.agent = agent

    async def handle(self, request: Request) -> Response:
        """Answer one request."""
        route = _ROUTES.of_path(request.parts).get(request.method)
        if route is None:
            return _no_such_page(request)
        try:
            return await route(self, request)
        except FiwareError as error:
            body = error.body("name", "message")
            return Response(error.status, body, content_type=_JSON)

    async def about(self, request: Request) -> Response:  # noqa: ARG002
        """``GET /iot/about`` and ``GET /version``."""
        return _json(_ABOUT)

    # --- groups -----------------------------------------------------------------

    async def list_groups(self, request: Request) -> Response:
        """``GET /iot/services``."""
        groups = self.agent.registry.groups(_tenancy(request))
        return _page(request, "services", groups)

    async def create_groups(self, request: Request) -> Response:
        """``POST /iot/services``."""
        tenancy = _tenancy(request)
        for raw in _listed(request, "services"):
            self.agent.registry.add_group(read_group(raw, tenancy))
        return _json({}, 201)

    async def change_group(self, request: Request) -> Response:
        """``PUT /iot/services``."""
        self.agent.registry.change_group(
            _tenancy(request), *_group_key(request), _object(request)
        )
        return Response(204)

    async def delete_group(self, request: Request) -> Response:
        """``DELETE /iot/services``."""
        self.agent.registry.remove_group(_tenancy(request), *_group_key(request))
        return Response(204)

    # --- devices ----------------------------------------------------------------

    async def list_devices(self, request: Request) -> Response:
        """``GET /iot/devices``."""
        devices = self.agent.registry.devices(_tenancy(request))
        return _page(request, "devices", devices)

    async def create_devices(self, request: Request) -> Response:
        """``POST /iot/devices``."""
        tenancy = _tenancy(request)
        for raw in _listed(request, "devices"):
            self.agent.provision(raw, tenancy)
        return _json({}, 201)

    async def get_device(self, request: Request) -> Response:
        """``GET /iot/devices/{id}``."""
        registry = self.agent.registry
        return _json(registry.device(_tenancy(request), request.parts[-1]).show())

    async def change_device(self, request: Request) -> Response:
        """``PUT /iot/devices/{id}``."""
        old = self.agent.registry.device(_tenancy(request), request.parts[-1])
        self.agent.change(old, old.changed(_object(request)))
        return Response(204)

    async def delete_device(self, request: Request) -> Response:
        """``DELETE /iot/devices/{id}``."""
        device = self.agent.registry.device(_tenancy(request), request.parts[-1])
        self.agent.forget(device)
        return Response(204)

    # --- context broker -------------------------------------------------------

    async def update(self, request: Request) -> Response:
        """``POST /op/update``."""
        tenancy = _tenancy(request)
        for entity in _listed(request, "entities"):
            values = {
                one: part.get("value")
                for one, part in entity.items()
                if isinstance(part, dict)
            }
            await self.agent.command(tenancy, *_entity_key(entity), values)
        return Response(204)

    async def query(self, request: Request) -> Response:
        """``POST /op/query``."""
        tenancy, raw = _tenancy(request), _object(request)
        names = raw.get("attrs", [])
        if not isinstance(names, list) or not all(isinstance(n, str) for n in names):
            raise wrong_syntax()
        answers = [
            await self.agent.query(tenancy, *_entity_key(entity), names)
            for entity in _listed(request, "entities")
        ]
        return _json(answers)


_ROUTES: Routes[_Route] = Routes(
    {
        "GET /iot/about": IotaApi.about,
        "GET /version": IotaApi.about,
        "GET /iot/services": IotaApi.list_groups,
        "POST /iot/services": IotaApi.create_groups,
        "PUT /iot/services": IotaApi.change_group,
        "DELETE /iot/services": IotaApi.delete_group,
        "GET /iot/devices": IotaApi.list_devices,
        "POST /iot/devices": IotaApi.create_devices,
        "GET /iot/devices/*": IotaApi.get_device,
        "PUT /iot/devices/*": IotaApi.change_device,
        "DELETE /iot/devices/*": IotaApi.delete_device,
        "POST /op/update": IotaApi.update,
        "POST /op/query": IotaApi.query,
    }
)


def _tenancy(request: Request) -> Tenancy:
    missing = [
        name
        for name in ("fiware-service", "fiware-servicepath")
        if not request.headers.get(name)
    ]
    if missing:
        raise FiwareError(
            "MISSING_HEADERS",
            "Some headers were missing from the request: "
            + orjson.dumps(missing).decode(),
        )
    return Tenancy(
        request.headers["fiware-service"].lower(),
        request.headers["fiware-servicepath"],
    )


def _object(request: Request) -> dict[str, object]:
    if not request.headers.get("content-type", "").startswith("application/json"):
        raise wrong_syntax()
    try:
        value = orjson.loads(request.body)
    except orjson.JSONDecodeError as error:
        # The real agent returns its parser's error as a 500.
        raise FiwareError("SyntaxError", str(error)) from None
    if not isinstance(value, dict):
        raise wrong_syntax()
    return value


def _listed(request: Request, name: str) -> list[dict[str, object]]:
    listed = _object(request).get(name)
    if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
        raise wrong_syntax()
    return listed


def _group_key(request: Request) -> tuple[str, str]:
    return request.query.get("resource", ""), request.query.get("apikey", "")


def _entity_key(entity: Mapping[str, object]) -> tuple[str, str]:
    return str(entity.get("id", "")), str(entity.get("type", ""))


def _page(
    request: Request, name: str, listed: Sequence[Group] | Sequence[AgentDevice]
) -> Response:
    limit, offset = request.query.get("limit", "20"), request.query.get("offset", "0")
    if not (limit.isdecimal() and offset.isdecimal()):
        raise wrong_syntax()
    shown = [one.show() for one in listed[int(offset) : int(offset) + int(limit)]]
    return _json({"count": len(listed), name: shown})


def _json(value: object, status: int = 200) -> Response:
    return Response(status, orjson.dumps(value), content_type=_JSON)


def _no_such_page(request: Request) -> Response:
    page = (
        '<!DOCTYPE html>\n<html lang="en">\n<body>\n'
        f"<pre>Cannot {request.method} that</pre>\n</body>\n</html>\n"
    )
    return Response(404, page.encode(), content_type="text/html; charset=utf-8")
