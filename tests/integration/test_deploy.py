"""The broker's access list before a real Mosquitto; the agent's health check."""

import asyncio
import contextlib
import os
import shutil
import signal
import socket
import subprocess
from collections import defaultdict
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

import aiomqtt
import pytest

from iveg.adapters.mqtt import BrokerAddress, MqttLink, TlsFiles
from iveg.adapters.orion import OrionClient
from iveg.lab.embedded.server import Running, embedded_fiware
from iveg.ngsi import names
from tests.bonds import bound
from tests.http_servers import Request, Response, http_server
from tests.ports import free_ports
from tests.processes import ROOT, children_of, until
from tests.unit.test_compose import env_of, make_secrets

SPY = "spy"
"""Hears and says everything; only the tests know it."""


def program(name: str) -> str:
    """Where a program is; continuous integration has them all."""
    found = shutil.which(name, path=f"{os.environ['PATH']}:/usr/sbin")
    if found is None:
        assert "CI" not in os.environ, f"{name} must be installed here"
        pytest.skip(f"{name} is not installed")
    return found


@dataclass
class Broker:
    """A Mosquitto with the deployment's own configuration."""

    port: int
    tls_port: int
    folder: Path
    passwords: dict[str, str] = field(default_factory=dict)

    def client(self, user: str | None, password: str | None = None) -> aiomqtt.Client:
        return aiomqtt.Client(
            "127.0.0.1",
            self.port,
            username=user,
            password=password or self.passwords.get(user or ""),
            timeout=20.0,
        )


@pytest.fixture(scope="module")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Broker]:
    port, tls_port = free_ports(2)
    broker = Broker(port, tls_port, tmp_path_factory.mktemp("broker"))
    make_users(broker)
    make_certificate(broker.folder / "secrets/mosquitto/tls")
    conf = broker.folder / "mosquitto.conf"
    # Started by root, Mosquitto would become a user who cannot enter here.
    root = "\nuser root\n" if os.geteuid() == 0 else ""
    conf.write_text(local(ROOT / "deploy/mosquitto.conf", broker) + root)
    encrypted = broker.folder / "secrets/mosquitto/conf.d/mosquitto-tls.conf"
    encrypted.write_text(local(ROOT / "deploy/mosquitto-tls.conf", broker))
    process = subprocess.Popen(bound(program("mosquitto"), "-c", str(conf)))
    try:
        until(lambda: listens(port), "Mosquitto listens")
        yield broker
    finally:
        process.terminate()
        process.wait(20)


def listens(port: int) -> bool:
    with contextlib.suppress(OSError):
        socket.create_connection(("127.0.0.1", port), timeout=1).close()
        return True
    return False


def make_users(broker: Broker, *more: str) -> None:
    """Users and access list as ``deploy/make-secrets`` makes them, and the spy."""
    secrets = make_secrets(broker.folder, "--emulator", *more)
    env = env_of(secrets)
    robots = (secrets / "mqtt-users").read_text().splitlines()
    broker.passwords = {
        **dict(line.split() for line in robots),
        "iveg_dss": env["IVEG_MQTT_PASSWORD"],
        "iot_agent": env["MQTT_AGENT_PASSWORD"],
        "iveg_emulator": env["MQTT_EMULATOR_PASSWORD"],
        "iveg_health": env["MQTT_HEALTH_PASSWORD"],
        SPY: env["MQTT_HEALTH_PASSWORD"],
    }
    users = (secrets / "mosquitto/passwords").read_text()
    health = next(one for one in users.splitlines() if one.startswith("iveg_health:"))
    with (secrets / "mosquitto/passwords").open("a") as out:
        out.write(f"{SPY}:{health.partition(':')[2]}\n")
    with (secrets / "mosquitto/acl").open("a") as out:
        out.write(f"\nuser {SPY}\ntopic readwrite #\n")


def local(conf: Path, broker: Broker) -> str:
    """The deployment's configuration with this machine's paths and ports."""
    return (
        conf.read_text()
        .replace("/mosquitto/secrets", str(broker.folder / "secrets/mosquitto"))
        .replace("/mosquitto/data", str(broker.folder / "state/mosquitto"))
        .replace("listener 1883", f"listener {broker.port} 127.0.0.1")
        .replace("listener 8883", f"listener {broker.tls_port} 127.0.0.1")
    )


def make_certificate(folder: Path) -> None:
    subprocess.run(
        [
            *(program("openssl"), "req", "-x509", "-newkey", "rsa:2048", "-nodes"),
            *("-days", "2", "-subj", "/CN=localhost"),
            *("-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"),
            *("-keyout", str(folder / "server.key")),
            *("-out", str(folder / "server.crt")),
        ],
        check=True,
        capture_output=True,
        timeout=60,
    )


# --- who may write what -----------------------------------------------------------

DEVICES = ("", "_odom", "_lidar2D", "_yolox_bounding_boxes", "_safety", "_nav")


def of_robot(robot: str) -> set[str]:
    """What a robot may write, written out once more by hand."""
    plain = {f"/iveg/{robot}{suffix}/attrs" for suffix in DEVICES}
    plain.add(f"/iveg/{robot}/cmdexe")
    return plain | {f"/json{topic}" for topic in plain} | straight(robot)


def straight(robot: str) -> set[str]:
    """What a robot tells iVeg past the agent."""
    kinds = ("safety", "odom", "lidar2D", "yolox_bounding_boxes")
    return {f"/{robot}/iveg/{kind}" for kind in kinds}


AIR = {"/iveg/climate/attrs", "/json/iveg/climate/attrs"}
COMMANDS = {"/iveg/AGI/cmd", "/iveg/AGII/cmd"}
FEEDBACK = {
    *("/AGI/mqtt_feedback", "/AGII/mqtt_feedback"),
    *("/AGI/iveg/peer_scan", "/AGII/iveg/peer_scan"),
}
DESIRED = {"/AGI/iveg/desired", "/AGII/iveg/desired"}
HEARTBEAT = {"/iveg/iveg-canary/attrs"}
ELSEWHERE = {
    "/1234/AGI/attrs",
    "/other/AGI/attrs",
    "/iveg/AGI/attrs/pose",
    "/iveg/AGI/configuration/commands",
    "/iveg/AGIII/attrs",
    "/AGI/iveg/other",
    "/AGIII/iveg/safety",
    "anything",
}
OF_IVEG = COMMANDS | FEEDBACK | DESIRED | HEARTBEAT
TOPICS = sorted(of_robot("AGI") | of_robot("AGII") | AIR | OF_IVEG | ELSEWHERE)
MAY_WRITE = {
    "AGI": of_robot("AGI"),
    "AGII": of_robot("AGII"),
    "climate": AIR,
    "iot_agent": COMMANDS,
    "iveg_dss": OF_IVEG,
    "iveg_emulator": of_robot("AGI") | of_robot("AGII") | AIR,
    "iveg_health": set(),
}
REPORTS = {
    topic
    for topic in TOPICS
    if topic.startswith("/iveg/") and topic.endswith(("/attrs", "/cmdexe"))
}
MAY_READ = {
    "AGI": {"/iveg/AGI/cmd", "/AGI/iveg/desired", *FEEDBACK},
    "AGII": {"/iveg/AGII/cmd", "/AGII/iveg/desired", *FEEDBACK},
    "climate": set(),
    "iot_agent": REPORTS
    | {topic for topic in TOPICS if topic.startswith("/json/")}
    | {"/iveg/AGI/attrs/pose"},
    "iveg_dss": REPORTS | straight("AGI") | straight("AGII") | {"/AGIII/iveg/safety"},
    "iveg_emulator": COMMANDS | FEEDBACK | DESIRED,
    "iveg_health": set(),
}


@pytest.mark.parametrize("user", MAY_WRITE)
async def test_a_user_writes_what_the_table_says_and_nothing_else(
    user: str, broker: Broker
) -> None:
    async with broker.client(SPY) as spy, broker.client(user) as client:
        await spy.subscribe("#", qos=1)
        for topic in TOPICS:
            await client.publish(topic, user, qos=1)
        await spy.publish("end", SPY, qos=1)
        written = await heard_until_end(spy)

    assert written[user] == MAY_WRITE[user]


@pytest.mark.parametrize("user", MAY_READ)
async def test_a_user_reads_what_the_table_says_and_nothing_else(
    user: str, broker: Broker
) -> None:
    async with broker.client(SPY) as spy, broker.client(user) as client:
        # At QoS 0 nothing waits for an acknowledgement, so the order is kept.
        await client.subscribe("#", qos=0)
        for topic in TOPICS:
            await spy.publish(topic, SPY, qos=1)
        # The broker answers in turn: what was to come has come before this answer.
        await client.unsubscribe("#")
        came = range(len(client.messages))
        read = {str((await anext(client.messages)).topic) for _ in came}

    assert read == MAY_READ[user]


async def heard_until_end(client: aiomqtt.Client) -> dict[str, set[str]]:
    """Topics by who wrote there."""
    heard: dict[str, set[str]] = defaultdict(set)
    async with asyncio.timeout(30):
        async for message in client.messages:
            if str(message.topic) == "end":
                break
            assert isinstance(message.payload, bytes)
            heard[message.payload.decode()].add(str(message.topic))
    return heard


async def first_word(client: aiomqtt.Client) -> object:
    async with asyncio.timeout(30):
        return (await anext(client.messages)).payload


async def test_the_agents_shared_subscriptions_hear_robots(broker: Broker) -> None:
    async with broker.client("iot_agent") as agent, broker.client("AGI") as robot:
        for topic in ("/+/+/attrs", "/+/+/attrs/+", "/+/+/cmdexe"):
            await agent.subscribe(f"$share/json/{topic}", qos=1)
        await robot.publish("/iveg/AGI/cmdexe", b"answer", qos=1)
        assert await first_word(agent) == b"answer"


@pytest.mark.parametrize(
    ("user", "password"), [(None, None), ("AGI", "wrong"), ("AGIII", "any")]
)
async def test_strangers_are_not_let_in(
    user: str | None, password: str | None, broker: Broker
) -> None:
    with pytest.raises(aiomqtt.MqttError, match=r"(?i)not authori[sz]ed"):
        async with broker.client(user, password):
            pass


async def _say_too_much(broker: Broker) -> None:
    async with broker.client("AGI") as robot, asyncio.timeout(15):
        await robot.publish("/iveg/AGI/attrs", bytes(200_000))
        await anext(robot.messages)


async def test_a_message_over_the_limit_ends_its_sender_and_nobody_else(
    broker: Broker,
) -> None:
    async with broker.client("iveg_dss") as dss:
        await dss.subscribe("/iveg/+/attrs", qos=1)
        # Of a line that is cut who waits for a message hears, and who publishes not.
        with pytest.raises(aiomqtt.MqttError, match="Disconnected"):
            await _say_too_much(broker)
        async with broker.client("AGI") as robot:
            await robot.publish("/iveg/AGI/attrs", bytes(100_000), qos=1)
        assert await first_word(dss) == bytes(100_000)


async def test_robots_may_come_encrypted(broker: Broker) -> None:
    """And with a certificate of their own."""
    tls = broker.folder / "secrets/mosquitto/tls"
    own, key = str(tls / "server.crt"), str(tls / "server.key")
    user = "AGI", broker.passwords["AGI"]
    files = TlsFiles(authority=own, certificate=own, key=key)
    address = BrokerAddress("127.0.0.1", broker.tls_port, *user, tls=True, files=files)
    robot = MqttLink(address, "AGI")

    async with broker.client("iveg_dss") as dss, asyncio.TaskGroup() as tasks:
        await dss.subscribe("/iveg/AGI/attrs", qos=1)
        running = tasks.create_task(robot.run())
        while not robot.connected:  # noqa: ASYNC110 - nothing tells of it
            await asyncio.sleep(0.01)
        await robot.publish("/iveg/AGI/attrs", b"encrypted", qos=1)
        assert await first_word(dss) == b"encrypted"
        running.cancel()


# --- robots that are refused ------------------------------------------------------


def test_a_refused_robot_has_no_user_and_no_place_in_the_access_list(
    tmp_path: Path,
) -> None:
    broker = Broker(0, 0, tmp_path)
    make_users(broker)
    with (tmp_path / "secrets/env").open("a") as env:
        env.write("IVEG_REFUSED_ROBOTS=AGI\n")
    make_users(broker)

    files = tmp_path / "secrets/mosquitto"
    assert "AGI" not in broker.passwords
    assert "AGI:" not in (files / "passwords").read_text()
    assert "/iveg/AGI/attrs" not in (files / "acl").read_text()
    assert "/iveg/AGII/attrs" in (files / "acl").read_text()


def test_robots_that_an_earlier_version_kept_out_do_not_come_in_by_an_update(
    tmp_path: Path,
) -> None:
    (tmp_path / "secrets").mkdir()
    (tmp_path / "secrets/revoked").write_text("AGI\n")

    with pytest.raises(subprocess.CalledProcessError):
        make_users(Broker(0, 0, tmp_path))

    assert not (tmp_path / "secrets/mosquitto").exists()


# --- the agent's health check -----------------------------------------------------


@dataclass
class Patient:
    """An agent in a container: a process whose parent is the container's init."""

    init: asyncio.subprocess.Process
    environment: dict[str, str]
    said: str = ""

    async def check(self) -> int:
        """What the container engine runs every five seconds; its exit code."""
        check = await asyncio.create_subprocess_exec(
            program("node"),
            str(ROOT / "deploy/agent-health.mjs"),
            env={"PATH": os.environ["PATH"], **self.environment},
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
        )
        said, _ = await check.communicate()
        self.said = said.decode()
        return int(check.returncode or 0)

    def counts(self) -> bool:
        """Whether the check has begun to count the silence."""
        return Path(self.environment["AGENT_SILENT_SINCE"]).exists()


@pytest.fixture
async def up() -> AsyncIterator[Running]:
    async with embedded_fiware() as running:
        yield running


@pytest.fixture
async def singer() -> AsyncIterator[int]:
    """Stands for iVeg, which answers and sings."""

    async def answer(request: Request) -> Response:
        return Response(200 if request.path == "/healthz" else 404)

    async with http_server(answer, "127.0.0.1", 0) as port:
        yield port


@pytest.fixture
async def patient(up: Running, singer: int, tmp_path: Path) -> AsyncIterator[Patient]:
    # A shell that waits for its child, as a container's init does.
    init = await asyncio.create_subprocess_exec("/bin/sh", "-c", "sleep 300; exit 0")
    patient = Patient(
        init,
        {
            "AGENT_PARENT": str(init.pid),
            "AGENT_SILENT_SINCE": str(tmp_path / "silent-since"),
            "AGENT_SILENCE_MS": "300",
            "AGENT_SINGER_URL": f"http://127.0.0.1:{singer}",
            "IOTA_NORTH_PORT": str(urlsplit(up.iota_url).port),
            "IOTA_CB_HOST": "127.0.0.1",
            "IOTA_CB_PORT": str(urlsplit(up.orion_url).port),
            "IOTA_MQTT_HOST": "127.0.0.1",
            "IOTA_MQTT_PORT": str(up.mqtt_port),
            "IVEG_FIWARE_SERVICE": "agroconnect",
            "IVEG_FIWARE_SERVICEPATH": "/greenhouse",
        },
    )
    yield patient
    for child in children_of(init.pid):
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
    await init.wait()


async def sing(up: Running) -> None:
    """One heartbeat probe reaches Orion."""
    async with OrionClient(up.orion_url, "agroconnect", "/greenhouse") as orion:
        await orion.ask(
            "POST",
            "/v2/entities",
            query={"options": "upsert"},
            body={
                "id": names.HEARTBEAT_ID,
                "type": names.HEARTBEAT_TYPE,
                "probe": {"type": "object", "value": {"seq": 1}},
            },
        )


async def first_deaf_look(patient: Patient) -> None:
    """Check until the heartbeat probe is too old."""
    async with asyncio.timeout(30):
        while await patient.check() == 0:
            pass


async def test_an_agent_is_healthy_before_the_first_heartbeat_and_while_it_hears(
    up: Running, patient: Patient
) -> None:
    assert await patient.check() == 0

    patient.environment["AGENT_SILENCE_MS"] = "60000"
    await sing(up)

    assert await patient.check() == 0
    assert patient.said == ""


async def test_a_deaf_agent_is_ended_and_not_on_the_first_look(
    up: Running, patient: Patient
) -> None:
    await sing(up)
    await first_deaf_look(patient)
    lived = children_of(patient.init.pid)

    async with asyncio.timeout(30):
        while children_of(patient.init.pid):
            assert await patient.check() == 1
        await patient.init.wait()

    assert len(lived) == 1
    assert "stopped receiving: no probe for" in patient.said


async def test_an_agent_that_hears_again_starts_with_a_clean_slate(
    up: Running, patient: Patient
) -> None:
    await sing(up)
    await first_deaf_look(patient)
    assert patient.counts()

    patient.environment["AGENT_SILENCE_MS"] = "60000"
    await sing(up)

    assert await patient.check() == 0
    assert not patient.counts()


async def test_a_hung_agent_is_unhealthy_whatever_the_heartbeat_says(
    up: Running, patient: Patient
) -> None:
    await sing(up)
    patient.environment["IOTA_NORTH_PORT"] = str(free_ports(1)[0])

    assert await patient.check() == 1
    assert "stopped receiving: no answer" in patient.said


@pytest.mark.parametrize(
    ("variable", "value"),
    [
        ("AGENT_SINGER_URL", "http://127.0.0.1:{}"),
        ("IOTA_MQTT_PORT", "{}"),
        ("IOTA_CB_PORT", "{}"),
    ],
)
async def test_the_agent_does_not_answer_for_others(
    variable: str, value: str, up: Running, patient: Patient
) -> None:
    await sing(up)
    await first_deaf_look(patient)

    patient.environment[variable] = value.format(free_ports(1)[0])

    assert await patient.check() == 0
    assert patient.init.returncode is None
