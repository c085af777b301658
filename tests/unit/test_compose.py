"""The real stack as it is written down: what can be known without starting it."""

import fnmatch
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml  # type: ignore[import-untyped]

from iveg.adapters.fleet_files import load_fleet
from iveg.settings import Settings
from tests.processes import ROOT

COMPOSE = (ROOT / "compose.yaml").read_text()
SERVICES: dict[str, dict[str, Any]] = yaml.safe_load(COMPOSE)["services"]
NETWORKS: dict[str, dict[str, Any]] = yaml.safe_load(COMPOSE)["networks"]
KNOWN = set(Settings().to_environment())
ASKED = set(re.findall(r"(?<!\$)\$\{(\w+)(:-|:\?|:\+|-|\})", COMPOSE))
MAY_BE_EMPTY = {"IVEG_FLEET", "IVEG_REFUSED_ROBOTS", "IVEG_MESSAGES_FILE"}
OF_OTHER_STACKS = r"IVEG_(PORT|MQTT_(C|KEY)|IOTA_CB|DATA|FIWARE_(?!SERV))"
"""Port, TLS inside, a directory of its own and a PEP proxy."""
LOOPBACK = r"(\$\{\w+:-)?127\.0\.0\.1\}?:"
PRIVATE = ("mongodb", "orion", "iot-agent", "postgresql", "iveg-migrate", "emulator")
DOCKERFILE = (ROOT / "Dockerfile").read_text()


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What ``deploy/make-secrets`` makes."""
    return make_secrets(tmp_path_factory.mktemp("site"))


def make_secrets(folder: Path, *more: str) -> Path:
    secrets = folder / "secrets"
    words = ("--directory", str(secrets), "--state", str(folder / "state"), *more)
    command = (sys.executable, str(ROOT / "deploy/make-secrets"), *words)
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    return secrets


def env_of(secrets: Path) -> dict[str, str]:
    lines = (secrets / "env").read_text().splitlines()
    return dict(line.split("=", 1) for line in lines if line and line[0] != "#")


def environment(service: str) -> dict[str, str]:
    told: dict[str, str | None] = SERVICES[service].get("environment", {})
    # Compose fills a variable without a value from the env file, if it is there.
    return {name: value or f"${{{name}-}}" for name, value in told.items()}


def test_compose_keeps_to_the_compose_specification() -> None:
    words = "-m check_jsonschema --builtin-schema vendor.compose-spec compose.yaml"
    command = [sys.executable, *words.split()]

    subprocess.run(command, cwd=ROOT, check=True, timeout=60)


@pytest.mark.parametrize("service", SERVICES)
def test_every_variable_of_iveg_is_a_setting(service: str) -> None:
    ours = {name for name in environment(service) if name.startswith("IVEG_")}
    ours -= {"IVEG_SITE"} if service == "caddy" else set()

    assert ours <= KNOWN


def test_a_site_can_choose_every_setting(made: Path) -> None:
    chosen = {"IVEG_FORESIGHT": "off", "IVEG_KEEP_PICTURES_GB": "1"}
    told = settings_of("iveg", env_of(made) | chosen).to_environment()
    left_out = KNOWN - set(environment("iveg"))

    assert [name for name in left_out if not re.match(OF_OTHER_STACKS, name)] == []
    assert chosen.items() <= told.items()


def test_the_page_is_reached_by_the_proxy_alone() -> None:
    proxy = NETWORKS["proxy"]
    (subnet,) = [one["subnet"] for one in proxy["ipam"]["config"]]
    inside = {name for name, one in SERVICES.items() if "proxy" in one["networks"]}
    caddy = (ROOT / "deploy/Caddyfile").read_text()

    assert inside == {"caddy", "iveg"}
    assert environment("iveg")["FORWARDED_ALLOW_IPS"] == subnet
    assert SERVICES["iveg"]["ports"] == ["127.0.0.1:8000:8000"]
    assert "reverse_proxy iveg:8000" in caddy
    assert "@inside path /ngsi/* /metrics\n\trespond @inside 404" in caddy


def filled(text: str, env: dict[str, str]) -> str:
    """A text with its variables, as Compose fills it."""

    def value(found: re.Match[str]) -> str:
        name, how, other = found.groups()
        told = env.get(name)
        if how == ":+":
            return other if told else ""
        return other if told is None or (how == ":-" and not told) else told

    return re.sub(r"\$\{(\w+)(:-|:\?|:\+|-)([^}]*)\}", value, text)


def settings_of(service: str, env: dict[str, str]) -> Settings:
    told = environment(service).items()
    return Settings.from_environment({name: filled(text, env) for name, text in told})


@pytest.mark.parametrize("service", ["iveg", "emulator"])
@pytest.mark.parametrize("file", ["", "deploy/fleet.example.toml"])
def test_a_fleet_file_is_mounted_where_the_service_reads_it(
    service: str, file: str, made: Path
) -> None:
    env = {**env_of(made), "IVEG_FLEET": file}
    mount = next(one for one in SERVICES[service]["volumes"] if isinstance(one, dict))

    settings = settings_of(service, env)

    assert settings.fleet == (mount["target"] if file else "")
    assert load_fleet(str(ROOT / filled(mount["source"], env))).ids
    assert mount["read_only"] is True


def test_every_variable_is_made_or_has_a_default(made: Path) -> None:
    env = env_of(made)

    for name, how in ASKED:
        assert env.get(name) or name in MAY_BE_EMPTY, f"{name} is in no env file"
        assert how != "}", f"{name} may be missing in silence"


def test_the_start_refuses_without_any_of_the_secrets(made: Path) -> None:
    example = (ROOT / "deploy/env.example").read_text()
    chosen = set(re.findall(r"^(\w+)=", example, re.MULTILINE))
    required = {name for name, how in ASKED if how == ":?"}

    assert required == set(env_of(made)) - chosen


@pytest.mark.parametrize("service", SERVICES)
def test_no_container_has_more_rights_than_it_needs(service: str) -> None:
    stands = SERVICES[service]

    assert stands["read_only"] is True
    assert stands["cap_drop"] == ["ALL"]
    assert stands["security_opt"] == ["no-new-privileges:true"]
    assert "mem_limit" in stands
    assert not stands.get("privileged")
    assert stands.get("user", "") not in ("root", "0")


@pytest.mark.parametrize("service", PRIVATE)
def test_what_asks_nobody_who_he_is_cannot_be_reached(service: str) -> None:
    networks = SERVICES[service]["networks"]

    assert "ports" not in SERVICES[service]
    assert [name for name in networks if not NETWORKS[name].get("internal")] == []


def test_ports_open_on_loopback_unless_a_site_chooses_otherwise() -> None:
    ports = [port for one in SERVICES.values() for port in one.get("ports", [])]

    assert len(ports) == 5
    assert [port for port in ports if not re.match(LOOPBACK, port)] == []


def test_the_history_is_migrated_before_iveg_serves() -> None:
    wanted = SERVICES["iveg"]["depends_on"]["iveg-migrate"]["condition"]

    assert SERVICES["iveg-migrate"]["command"] == ["db", "upgrade"]
    assert wanted == "service_completed_successfully"


OF_IVEG = "IVEG_MQTT_PASSWORD IVEG_NOTIFY_TOKEN IVEG_API_TOKEN IVEG_SIGN_IN_TOKEN"


@pytest.mark.parametrize(
    ("service", "named"),
    [
        ("iveg", {"POSTGRES_PASSWORD", *OF_IVEG.split()}),
        ("emulator", {"MQTT_EMULATOR_PASSWORD"}),
        ("iveg-migrate", {"POSTGRES_PASSWORD"}),
    ],
)
def test_only_what_a_service_needs_is_told_to_it(service: str, named: set[str]) -> None:
    """The emulator plays robots: it is not to know iVeg's own secrets."""
    told = " ".join(environment(service).values())

    assert set(re.findall(r"\$\{(\w*(?:PASSWORD|TOKEN))", told)) == named


# --- the image --------------------------------------------------------------------

IGNORE = (ROOT / ".dockerignore").read_text().splitlines()
ALLOWED = [line[1:] for line in IGNORE if line.startswith("!")]


def test_the_image_is_made_of_files_that_the_build_may_see() -> None:
    copies = re.findall(r"^COPY (?!--from)(.+) \S+$", DOCKERFILE, re.MULTILINE)
    sources = [source for line in copies for source in line.split()]

    assert IGNORE[1] == "*"
    assert sorted(ALLOWED) == sorted(sources)
    assert [source for source in sources if not (ROOT / source).exists()] == []


def test_no_secret_gets_into_the_image() -> None:

    assert not any(fnmatch.fnmatch("deploy/secrets/env", one) for one in ALLOWED)
    assert (ROOT / "deploy/.gitignore").read_text().split() == [
        "secrets/",
        "state/",
        "fleet.toml",
    ]


def test_the_image_has_the_libraries_of_the_product_and_of_every_way_in() -> None:
    locked = {
        name: _locked((ROOT / f"requirements/{name}.lock").read_text())
        for name in ("run", "image", "dev")
    }

    beside = {name for name, _ in locked["image"] - locked["run"]}
    assert locked["run"] < locked["image"] <= locked["dev"]
    assert {"psycopg", "authlib", "httpx2"} <= beside
    assert re.findall(r"-r (\S+)", DOCKERFILE) == ["image.lock", "audit.lock"]


def _locked(text: str) -> set[tuple[str, str]]:
    return set(re.findall(r"^([\w-]+)==(\S+)", text, re.MULTILINE))


def test_the_base_of_the_image_is_one_by_its_digest() -> None:
    bases = re.findall(r"^FROM (python:\S+) AS", DOCKERFILE, re.MULTILINE)

    assert len(bases) == 3
    assert len(set(bases)) == 1
    assert re.search(r"@sha256:[0-9a-f]{64}$", bases[0])


# --- make-secrets -----------------------------------------------------------------


def test_every_secret_is_random_and_long(made: Path, tmp_path: Path) -> None:
    first, second = env_of(made), env_of(make_secrets(tmp_path))
    secret = [name for name in first if re.search("PASSWORD|TOKEN", name)]

    assert len(secret) == 9
    assert len({first[name] for name in secret}) == len(secret)
    assert [name for name in secret if first[name] == second[name]] == []
    assert {len(first[name]) for name in secret} == {64}


def test_made_again_nothing_changes_but_what_was_deleted(tmp_path: Path) -> None:
    secrets = make_secrets(tmp_path)
    before, robots = env_of(secrets), (secrets / "mqtt-users").read_text()
    env = (secrets / "env").read_text()
    gone = f"IVEG_API_TOKEN={before['IVEG_API_TOKEN']}\n"
    (secrets / "env").write_text(env.replace(gone, ""))

    after = env_of(make_secrets(tmp_path))

    changed = {name for name in after if after[name] != before[name]}
    assert changed == {"IVEG_API_TOKEN"}
    assert set(after) == set(before)
    assert (secrets / "mqtt-users").read_text() == robots


def test_users_are_those_of_the_fleet_file(tmp_path: Path) -> None:
    secrets = make_secrets(tmp_path)
    env = (secrets / "env").read_text().replace("IVEG_ROBOTS=AGI,AGII", "IVEG_ROBOTS=")
    (secrets / "env").write_text(
        env.replace("IVEG_FLEET=", "IVEG_FLEET=deploy/fleet.example.toml")
    )

    make_secrets(tmp_path)

    lines = (secrets / "mqtt-users").read_text().splitlines()
    assert [line.split()[0] for line in lines] == ["AGI", "CARRIER-2", "D1", "climate"]


def test_secrets_are_closed_to_others(made: Path) -> None:
    open_ = [path for path in (made, *made.rglob("*")) if path.stat().st_mode & 0o077]

    assert open_ == []


def test_a_fleet_that_cannot_be_is_refused_before_anything_is_written(
    tmp_path: Path,
) -> None:
    secrets = tmp_path / "secrets"
    secrets.mkdir()
    (secrets / "env").write_text("IVEG_ROBOTS=A/B\n")

    with pytest.raises(subprocess.CalledProcessError) as refused:
        make_secrets(tmp_path)

    assert refused.value.returncode == 2
    assert b"IVEG_ROBOTS" in refused.value.stderr
    assert [path.name for path in secrets.iterdir()] == ["env"]


def test_no_part_can_be_taken_for_a_robot(made: Path) -> None:
    users = re.findall(
        r"^user (\S+)$", (made / "mosquitto/acl").read_text(), re.MULTILINE
    )
    parts = [user for user in users if user not in ("AGI", "AGII", "climate")]

    assert parts == ["iot_agent", "iveg_dss", "iveg_health"]
    assert [user for user in parts if re.fullmatch("[A-Za-z0-9-]+", user)] == []
