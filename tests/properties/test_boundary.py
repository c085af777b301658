"""Whatever comes over whichever door: one clear refusal, or one counted bad message.

Doors are HTTP, ``/live``, MQTT and Orion's notifications.  Never a failure of ours, and
nothing kept that a page would show turned round, cut at a NUL or broken in half.
"""

import unicodedata
from collections.abc import Iterator
from typing import Any, Final

import orjson
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from iveg.adapters.direct import DirectReader
from iveg.domain.observations import Navigation, Received
from iveg.domain.world import World
from iveg.models.base import write_json
from iveg.ngsi import codec
from iveg.vital.ingest import Ingest
from tests.builders import at, ignore, notification, origin, pose_value
from tests.unit.web.desk import WebDesk
from tests.unit.web.live.test_socket import looking
from tests.unit.web.whole import WholeServer, whole_server

BIDI: Final = "a\u202eb\u2066c\u200fd"
SIGNS: Final = {
    "deep": "[" * 10_000 + "]" * 10_000,
    "deep object": '{"a":' * 10_000 + "1" + "}" * 10_000,
    "NaN": "NaN",
    "Infinity": "-Infinity",
    "huge": "1" + "0" * 5000,
    "beyond a double": "1e999",
    "bidi": orjson.dumps(BIDI).decode(),
    "NUL": '"a\\u0000b"',
    "half a character": '"a\\ud800b"',
    "long": '"' + "x" * 100_000 + '"',
    "truth": "true",
    "nothing": "null",
}
"""JSON texts that stand where a value is expected."""
BODIES: Final[dict[str, dict[str, Any]]] = {
    "POST /api/v1/notes": {"text": "t", "x": 1.0, "y": 1.0, "robot_id": "AGI"},
    "POST /api/v1/robots/AGI/stop": {"press_id": "p", "pressed_at": 1.0},
    "POST /api/v1/fleet/stop": {"press_id": "p", "pressed_at": 1.0},
    "POST /api/v1/robots/AGI/release": {"holds": ["h"]},
    "POST /api/v1/robots/AGI/goal": {"kind": "aisle", "aisle": "1"},
    "PUT /api/v1/robots/AGI/detector": {"in_service": True},
    "POST /api/v1/alerts/acknowledge": {"alert_ids": ["a"], "note": "n"},
    "POST /api/v1/alerts/A/acknowledge": {"note": "n"},
    "PUT /api/v1/rule": {"version": 1, "radius_m": 2.0, "aliases": {"man": "person"}},
    "POST /api/v1/things": {"person_id": "P1"},
    "POST /api/v1/users": {"name": "n", "role": "viewer", "days": 3},
    "PUT /api/v1/users/U/role": {"role": "viewer"},
    "POST /signin": {"token": "t"},
}


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WholeServer]:
    with whole_server(tmp_path_factory.mktemp("server")) as server:
        yield server


@pytest.mark.parametrize("sign", SIGNS)
@pytest.mark.parametrize("route", BODIES)
def test_no_value_in_a_body_breaks_a_route_or_is_kept_as_it_came(
    server: WholeServer, route: str, sign: str
) -> None:
    method, path = route.split()
    server.records.clear()

    for body in _with(BODIES[route], SIGNS[sign]):
        answer = server.ask(
            "admin",
            method,
            path,
            content=body.encode(),
            headers={"Content-Type": "application/json"},
        )

        assert answer.status_code < 500, body[:200]
        if answer.status_code >= 400:
            assert answer.headers["content-type"] == "application/problem+json"
        assert _unseen(answer.content) == set()
    assert _unseen(orjson.dumps(server.records, default=str)) == set()


@pytest.mark.parametrize("encoding", ["utf-16", "utf-32", "utf-8-sig", "latin-1"])
def test_a_body_in_another_encoding_is_read_right_or_refused(
    server: WholeServer, encoding: str
) -> None:
    text = "Riego de la fila 4: añadir"
    body = f'{{"text": "{text}"}}'.encode(encoding)

    answer = server.ask(
        "admin",
        "POST",
        "/api/v1/notes",
        content=body,
        headers={"Content-Type": "application/json"},
    )

    is_read = answer.status_code == 201 and text in str(server.records)
    assert is_read or answer.status_code == 400


def test_a_broken_body_does_not_hold_up_a_stop(server: WholeServer) -> None:
    for sign in SIGNS.values():
        answer = server.ask(
            "viewer",
            "POST",
            "/api/v1/robots/AGI/stop",
            content=f'{{"press_id": {sign}'.encode(),
            headers={"Content-Type": "application/json"},
        )

        assert answer.status_code == 202


@settings(max_examples=30, suppress_health_check=list(HealthCheck))
@given(st.text(max_size=80), st.sampled_from([BIDI, "\x00", "\ufeff", "\u2028"]))
def test_no_text_in_a_query_or_path_breaks_a_route(
    server: WholeServer, text: str, mark: str
) -> None:
    odd = (text + mark).encode(errors="surrogatepass")
    written = "".join(f"%{byte:02x}" for byte in odd)

    for path in ("decisions?robot=", "log?class=", "robots/", "commands/", "things/"):
        answer = server.ask("admin", "GET", f"/api/v1/{path}{written}")

        assert answer.status_code < 500
        assert _unseen(answer.content) == set()


async def test_no_value_in_a_command_on_live_ends_the_line() -> None:
    desk = WebDesk()
    async with desk.serving() as address, looking(desk, address) as browser:
        await browser.read()
        for sign in SIGNS.values():
            await browser.socket.send(f'{{"type": "stop", "robot_id": {sign}}}')
        await browser.say(type="ping", t=1)
        told = await browser.read_until("pong")

    assert _unseen(told) == set()


@pytest.mark.parametrize("sign", [one for one in SIGNS if one != "nothing"])
def test_a_message_on_mqtt_is_taken_clean_or_counted_once(sign: str) -> None:
    heard: list[Received] = []
    intake = Ingest(World(("AGI",)), heard.append, ignore)
    reader = DirectReader("iveg", ("AGI",), lambda: at(1.0), intake, "all", ignore)
    measure = orjson.loads(codec.write_measure(Navigation("AGI", origin(), "row 4")))

    for body in _with(measure, SIGNS[sign]):
        before = intake.counters.total()
        reader.read("/iveg/AGI_nav/attrs", body.encode())
        assert intake.counters.total() == before + 1, body[:200]

    assert _unseen(orjson.dumps([one.observation for one in heard])) == set()


@pytest.mark.parametrize("sign", SIGNS.values(), ids=SIGNS)
async def test_a_notification_is_taken_clean_or_refused_or_counted(sign: str) -> None:
    desk = WebDesk()
    whole = notification({"base_pose_ground_truth": "HERE"}).decode()
    async with desk.orion() as orion:
        for inner in _with(pose_value(), sign):
            body = whole.replace('"HERE"', inner)
            answer = await orion.post("/ngsi/notifications", content=body.encode())
            assert answer.status_code in (204, 400, 413), inner[:200]

    assert _unseen(write_json(desk.views.robots(desk.clock()))) == set()
    assert _unseen(orjson.dumps(desk.sink.records, default=str)) == set()


def _with(body: dict[str, Any], sign: str) -> Iterator[str]:
    """The body with the sign as whole, as a name, as and in each value."""
    yield sign
    if sign.startswith('"'):
        yield f"{{{sign}: 1, {orjson.dumps(body).decode()[1:]}"
    for name in body:
        others = {key: value for key, value in body.items() if key != name}
        rest = f"{', ' if others else ''}{orjson.dumps(others).decode()[1:]}"
        yield f'{{"{name}": {sign}{rest}'
        yield f'{{"{name}": 1, "{name}": [{sign}]{rest}'


def _unseen(told: object) -> set[str]:
    """Characters in the texts of some JSON that turn others round or end them."""
    match told:
        case bytes():
            return _unseen(orjson.loads(told)) if told else set()
        case str():
            return {c for c in told if unicodedata.category(c)[0] == "C"}
        case list():
            return {c for one in told for c in _unseen(one)}
        case dict():
            return {c for pair in told.items() for one in pair for c in _unseen(one)}
    return set()
