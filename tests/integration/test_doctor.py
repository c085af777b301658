"""The doctor against a FIWARE that is up, receives nothing, is half dead or gone."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest

from iveg.adapters import clock
from iveg.adapters.history.engine import upgrade
from iveg.adapters.orion import OrionClient
from iveg.adapters.reconciler import ensure_subscriptions, wanted_for
from iveg.cli.doctor import Finding, Findings, examine
from iveg.domain.probe import Hop
from iveg.lab.embedded.server import Running
from iveg.settings import Settings
from tests.fakes.pep_proxy import CLIENT, SECRET, FakePepProxy
from tests.fakes.serving import served
from tests.faulty_fiware import Faults, fail, faulty_fiware
from tests.http_servers import Request, Response, http_server
from tests.ports import free_ports
from tests.processes import Site

SHORT_S, LONG_S = 1.0, 20.0
TENANT = ("agroconnect", "/greenhouse")


@pytest.fixture
async def up() -> AsyncIterator[Running]:
    async with faulty_fiware() as running:
        yield running


@pytest.fixture
async def page() -> AsyncIterator[int]:
    async def healthy(request: Request) -> Response:
        known = request.path in ("/healthz", "/ngsi/notifications")
        return Response(200 if known else 404)

    async with http_server(healthy, "127.0.0.1", 0) as port:
        yield port


@pytest.fixture
async def settings(up: Running, page: int, tmp_path: Path) -> Settings:
    database = f"sqlite:///{tmp_path / 'history.sqlite'}"
    await asyncio.to_thread(upgrade, database)
    await subscribe(up, f"http://127.0.0.1:{page}/ngsi/notifications")
    return Settings(
        port=page,
        mqtt_url=f"mqtt://127.0.0.1:{up.mqtt_port}",
        orion_url=up.orion_url,
        iota_url=up.iota_url,
        database_url=database,
    )


async def subscribe(up: Running, url: str) -> None:
    async with OrionClient(up.orion_url, *TENANT) as orion:
        await ensure_subscriptions(orion, url, "token", wanted_for())


async def find(
    settings: Settings, folder: Path, patience_s: float = LONG_S
) -> Findings:
    findings: Findings = {}
    async with asyncio.timeout(60):
        await examine(settings, folder, findings, patience_s)
    return findings


def failed(findings: Findings) -> set[Hop]:
    return {hop for hop, found in findings.items() if not found.is_ok}


async def test_a_whole_chain_is_well(settings: Settings, tmp_path: Path) -> None:
    assert await find(settings, tmp_path) == dict.fromkeys(Hop, Finding(True))


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
        whole = await find(behind, tmp_path)
        orion.vice = "no_role"
        refused = await find(behind, tmp_path)

    assert whole == dict.fromkeys(Hop, Finding(True))
    assert failed(refused) == {Hop.ORION}
    assert refused[Hop.ORION].said.startswith("403 ")
    assert {status for token, status in agent.seen if not token} == set()


async def test_a_deaf_agent_is_found_and_one_that_is_behind_says_how_late(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    """Of both the agent's own port says that all is well."""
    fail(up, Faults(deaf=True))
    deaf = await find(settings, tmp_path, SHORT_S)
    fail(up, Faults(slow_s=1.4))
    slow = await find(settings, tmp_path)

    assert failed(deaf) == {Hop.AGENT}
    assert deaf[Hop.AGENT].said == "nothing came in 1 s"
    assert failed(slow) == set()
    assert slow[Hop.AGENT].said.startswith("measures reach Orion 1.")


async def test_a_dead_orion_leaves_the_broker_well_and_no_history_is_made(
    settings: Settings, tmp_path: Path
) -> None:
    file = tmp_path / "none.sqlite"
    dead = f"http://127.0.0.1:{free_ports(1)[0]}"
    bare = replace(settings, orion_url=dead, database_url=f"sqlite:///{file}")

    findings = await find(bare, tmp_path)

    assert failed(findings) == {Hop.ORION, Hop.DATABASE}
    assert set(Hop) - set(findings) == {Hop.AGENT, Hop.NOTIFICATIONS}
    assert not file.exists()


async def test_an_address_that_orion_cannot_reach_is_a_failed_notification(
    up: Running, settings: Settings, tmp_path: Path
) -> None:
    await subscribe(up, f"http://127.0.0.1:{free_ports(1)[0]}/ngsi/notifications")
    await find(settings, tmp_path)

    findings = await find(settings, tmp_path)

    assert failed(findings) == {Hop.NOTIFICATIONS}
    assert "cannot deliver" in findings[Hop.NOTIFICATIONS].said


def test_the_command_ends_with_1_where_nothing_runs(place: Site) -> None:
    doctor = place.start("doctor")

    assert doctor.process.wait(60) == 1
    assert doctor.text().startswith("mqtt")
    assert "IVEG_ORION_URL" in doctor.text()
    assert doctor.complaints() == []
