"""The doctor against a FIWARE that is up, receives nothing, is half dead or gone."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import orjson
import pytest

from iveg.adapters import clock
from iveg.adapters.fleet_provisioning import provision
from iveg.adapters.history.migrate import upgrade
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.orion import OrionClient
from iveg.cli.diagnosis import State, exit_code, judge
from iveg.cli.doctor import Examination
from iveg.cli.probe import DESCRIPTION, PROBE_ID
from iveg.domain.hops import Check
from iveg.lab.embedded.http_server import Request, Response, http_server
from iveg.lab.embedded.server import Running
from iveg.settings import Settings
from tests.fakes.pep_proxy import CLIENT, SECRET, FakePepProxy
from tests.fakes.serving import served
from tests.faulty_fiware import MODULE, Faults, fail, faulty_fiware, heard_late
from tests.integration.emulator_cloud import until
from tests.ports import free_ports
from tests.processes import Site
from tests.processes import until as wait_for

SHORT_S, LONG_S = 0.5, 20.0
TENANT = ("agroconnect", "/greenhouse")


@pytest.fixture
async def up() -> AsyncIterator[Running]:
    async with faulty_fiware() as running:
        yield running


@pytest.fixture
async def page() -> AsyncIterator[int]:
    async with http_server(healthy, "127.0.0.1", 0) as port:
        yield port


async def healthy(request: Request) -> Response:
    return Response(200 if request.path == "/healthz" else 404)


@pytest.fixture
async def settings(up: Running, page: int, tmp_path: Path) -> Settings:
    database = f"sqlite:///{tmp_path / 'history.sqlite'}"
    await asyncio.to_thread(upgrade, database)
    return Settings(
        port=page,
        mqtt_url=up.mqtt_url,
        orion_url=up.orion_url,
        iota_url=up.iota_url,
        database_url=database,
    )


async def examine(
    settings: Settings, folder: Path, patience_s: float = LONG_S
) -> tuple[dict[Check, State], Examination]:
    examination = Examination(settings, folder, patience_s)
    async with asyncio.timeout(60):
        await examination.run()
    rows = judge(examination.findings, examination.stack)
    return {row.check: row.state for row in rows}, examination


async def leftovers(up: Running) -> list[dict[str, Any]]:
    """Whatever of the doctor's is still at Orion or the agent."""
    async with (
        OrionClient(up.orion_url, *TENANT) as orion,
        IotAgentClient(up.iota_url, *TENANT) as agent,
    ):
        entities = await orion.read_entities("Probe", ["probe"])
        return [
            *[one for one in entities if one["id"] == PROBE_ID],
            *[one for one in await orion.read_registrations() if PROBE_ID in str(one)],
            *[
                one
                for one in await orion.read_subscriptions()
                if one.get("description") == DESCRIPTION
            ],
            *[one for one in await agent.read_devices() if PROBE_ID in str(one)],
            *await agent.read_groups(),
        ]


async def test_a_whole_chain_is_well_and_nothing_of_the_doctors_stays(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    states, examination = await examine(settings, tmp_path)

    assert states == dict.fromkeys(Check, "ok")
    assert examination.left_behind == []
    assert await leftovers(up) == []


async def test_behind_pep_proxies_all_is_well_until_one_of_them_refuses(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    orion = FakePepProxy(up.orion_url, clock.mono)
    agent = FakePepProxy(up.iota_url, clock.mono, given=orion.given)
    async with served(orion.app()) as orion_url, served(agent.app()) as agent_url:
        behind = replace(
            settings,
            orion_url=orion_url,
            iota_url=agent_url,
            iota_cb_url=up.orion_url,
            fiware_token_url=f"{orion_url}/oauth2/token",
            fiware_client_id=CLIENT,
            fiware_client_secret=SECRET,
        )
        whole, _ = await examine(behind, tmp_path)
        orion.vice = "no_role"
        refused, examination = await examine(behind, tmp_path)
        rows = judge(examination.findings, examination.stack)
        (said,) = (row.sentence for row in rows if row.check == Check.ORION)

    assert whole == dict.fromkeys(Check, "ok")
    assert (refused[Check.ORION], refused[Check.AGENT]) == ("failed", "ok")
    assert said.startswith(f"A proxy before Orion at {orion_url} refuses iVeg (403")
    assert await leftovers(up) == []
    assert {status for token, status in agent.seen if not token} == set()


async def test_a_group_that_was_there_stays(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    async with IotAgentClient(up.iota_url, *TENANT) as agent:
        group = {"apikey": "iveg", "resource": "/iot/json", "entity_type": "Robot"}
        await agent.create_group(group)
        await examine(settings, tmp_path)

        assert [one["apikey"] for one in await agent.read_groups()] == ["iveg"]


async def test_what_a_killed_doctor_left_is_no_hindrance_and_goes(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    async with (
        OrionClient(up.orion_url, *TENANT) as orion,
        IotAgentClient(up.iota_url, *TENANT) as agent,
    ):
        device = {"device_id": PROBE_ID, "entity_name": PROBE_ID, "apikey": "iveg"}
        await agent.create_device({**device, "entity_type": "Probe"})
        await orion.create_subscription(
            {
                "description": DESCRIPTION,
                "subject": {"entities": [{"id": PROBE_ID, "type": "Probe"}]},
                "notification": {"http": {"url": "http://127.0.0.1:9/"}},
            }
        )

    states, _ = await examine(settings, tmp_path)

    assert states == dict.fromkeys(Check, "ok")
    assert await leftovers(up) == []


async def test_a_deaf_agent_is_found_though_it_says_that_all_is_well(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    fail(up, Faults(deaf=True))

    states, examination = await examine(settings, tmp_path, SHORT_S)

    failed = {check for check, state in states.items() if state != "ok"}
    assert failed == {Check.MEASURE, Check.ANSWER}
    rows = judge(examination.findings, examination.stack)
    measure = next(row for row in rows if row.check == Check.MEASURE)
    assert "receives nothing" in measure.sentence
    assert exit_code(rows) == 1
    assert await leftovers(up) == []


async def test_an_agent_that_is_behind_is_called_late_and_not_misconfigured(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    fail(up, Faults(slow_s=1.4))

    states, examination = await examine(settings, tmp_path, 1.0)

    assert states[Check.DEVICE] == states[Check.COMMAND] == "ok"
    assert states[Check.MEASURE] == "failed"
    rows = judge(examination.findings, examination.stack)
    sentence = next(row for row in rows if row.check == Check.MEASURE).sentence
    assert sentence.startswith("Measures reach Orion ")
    assert "at least" not in sentence
    assert "is overloaded" in sentence


async def test_the_running_ivegs_figure_is_believed_and_nothing_is_added(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    agent = {"hop": "iot_agent", "lag_s": 23.4, "growing": True}

    async def told(request: Request) -> Response:
        assert request.headers["authorization"] == "Bearer secret"
        return Response(200, orjson.dumps({"hops": [agent]}))

    async with http_server(told, "127.0.0.1", 0) as port:
        busy = replace(settings, port=port, api_token="secret")
        states, examination = await examine(busy, tmp_path)

    rows = judge(examination.findings, examination.stack)
    sentence = next(row for row in rows if row.check == Check.MEASURE).sentence
    assert sentence.startswith(
        "Measures reach Orion 23 s late, growing, as the running"
    )
    assert {states[check] for check in (Check.DEVICE, Check.COMMAND, Check.ANSWER)} == {
        "not tried"
    }
    assert states[Check.NOTIFICATION] == states[Check.DIRECT] == "ok"
    assert await leftovers(up) == []


async def test_a_measure_that_comes_after_the_doctor_went_leaves_nothing(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    async with (
        IotAgentClient(up.iota_url, *TENANT) as agent,
        OrionClient(up.orion_url, *TENANT) as orion,
    ):
        await provision(agent, orion, [], "iveg", up.orion_url)
        fail(up, Faults(slow_s=3.0))

        await examine(settings, tmp_path, SHORT_S)
        before = heard_late(up)
        await until(lambda: heard_late(up) > before)

        made_up = [PROBE_ID, f"Robot:{PROBE_ID}"]
        assert await orion.find_entities(made_up) == []
        assert PROBE_ID not in str(await agent.read_devices())


async def test_a_visit_ends_in_time_though_nobody_answers(
    settings: Settings, tmp_path: Path
) -> None:
    async def hang(_: Request) -> Response:
        await asyncio.sleep(60)
        return Response(204)

    async with http_server(hang, "127.0.0.1", 0) as port:
        url = f"http://127.0.0.1:{port}"
        hung = replace(settings, orion_url=url, iota_url=url, port=port)
        examination = Examination(hung, tmp_path, limit_s=6.0)
        async with asyncio.timeout(6.0):
            await examination.run()

    rows = judge(examination.findings, examination.stack)
    agent = next(row for row in rows if row.check == Check.AGENT)
    assert "overloaded or hung" in agent.sentence


async def test_a_dead_broker_leaves_orion_and_the_page_well(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    dead = replace(settings, mqtt_url=f"mqtt://127.0.0.1:{free_ports(1)[0]}")

    states, _ = await examine(dead, tmp_path)

    assert states[Check.BROKER] == "failed"
    assert {check for check, state in states.items() if state == "not tried"} == {
        Check.MEASURE,
        Check.COMMAND,
        Check.ANSWER,
        Check.DIRECT,
    }
    assert states[Check.NOTIFICATION] == states[Check.PAGE] == "ok"
    assert await leftovers(up) == []


async def test_a_dead_orion_leaves_the_straight_road_well(
    settings: Settings, tmp_path: Path
) -> None:
    dead = replace(settings, orion_url=f"http://127.0.0.1:{free_ports(1)[0]}")

    states, examination = await examine(dead, tmp_path)

    assert states[Check.ORION] == "failed"
    assert states[Check.BROKER] == states[Check.AGENT] == states[Check.DIRECT] == "ok"
    assert states[Check.DEVICE] == states[Check.NOTIFICATION] == "not tried"
    assert examination.left_behind == []


async def test_an_address_that_orion_cannot_reach_is_a_failed_notification(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    url = "http://nowhere.invalid:8000/ngsi/notifications"

    states, examination = await examine(
        replace(settings, notify_url=url), tmp_path, SHORT_S
    )

    assert {check for check, state in states.items() if state != "ok"} == {
        Check.NOTIFICATION
    }
    rows = judge(examination.findings, examination.stack)
    sentence = next(row for row in rows if row.check == Check.NOTIFICATION).sentence
    assert "http://nowhere.invalid:" in sentence
    assert "IVEG_NOTIFY_URL" in sentence
    assert await leftovers(up) == []


async def test_a_doctor_that_is_sent_away_still_tidies_up(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    fail(up, Faults(deaf=True))
    examination = Examination(settings, tmp_path, LONG_S)
    visit = asyncio.create_task(examination.run())
    await until(lambda: Check.DEVICE in examination.findings)

    visit.cancel()
    await asyncio.gather(visit, return_exceptions=True)

    assert Check.MEASURE not in examination.findings
    assert await leftovers(up) == []


async def test_a_history_that_is_not_there_is_not_made(
    settings: Settings, tmp_path: Path
) -> None:
    file = tmp_path / "none.sqlite"

    states, _ = await examine(
        replace(settings, database_url=f"sqlite:///{file}"), tmp_path
    )

    assert states[Check.DATABASE] == "failed"
    assert not file.exists()


async def test_a_history_without_migrations_is_told_from_a_good_one(
    settings: Settings, tmp_path: Path
) -> None:
    (tmp_path / "empty.sqlite").touch()
    empty = replace(settings, database_url=f"sqlite:///{tmp_path / 'empty.sqlite'}")

    _, examination = await examine(empty, tmp_path)

    trouble = examination.findings[Check.DATABASE].trouble
    assert "it is at migration none" in str(trouble)


def test_the_command_prints_the_table_and_ends_with_1_where_nothing_runs(
    place: Site,
) -> None:
    doctor = place.start("doctor")

    assert doctor.process.wait(60) == 1
    assert doctor.text().startswith("hop")
    assert f"No Orion at {place.settings['IVEG_ORION_URL']}" in doctor.text()
    assert doctor.complaints() == []


def test_the_command_ends_with_0_beside_a_running_iveg(served: Site) -> None:
    doctor = served.start("doctor")

    assert doctor.process.wait(90) == 0, doctor.text()
    served.stop_all()
    served.assert_clean()


def test_ctrl_c_ends_a_visit_with_a_table_and_nothing_left(place: Site) -> None:
    place.start("fiware", module=MODULE).wait_until_ready()
    agent = place.settings["IVEG_IOTA_URL"]
    tenant = {"Fiware-Service": TENANT[0], "Fiware-ServicePath": TENANT[1]}
    with httpx.Client(base_url=agent, headers=tenant, trust_env=False) as http:
        http.post("/test/faults", json={"deaf": True}).raise_for_status()
        doctor = place.start("doctor")
        wait_for(lambda: PROBE_ID in http.get("/iot/devices").text, "the probe")

        code = doctor.interrupt()

        assert code == 1
        assert "not tried" in doctor.text()
        assert http.get("/iot/devices").json()["count"] == 0
    assert doctor.complaints() == []
