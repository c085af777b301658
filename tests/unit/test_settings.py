"""Every bad value is one sentence with setting, value and what is allowed."""

import pytest

from iveg.adapters.fleet_files import load_fleet
from iveg.domain.errors import SettingsError
from iveg.domain.parameters import Parameters
from iveg.domain.recordings import RecordingLimits
from iveg.settings import Settings

_SHARE = "a number from 0 to 1, also by class (2,robot=3)"
_RADIUS = "a number from 0.5 to 6, also by class (2,robot=3)"
BAD = [
    ("IVEG_PORT", "0", "a port from 1 to 65535"),
    ("IVEG_PORT", "\u0663", "a port from 1 to 65535"),
    ("IVEG_MQTT_URL", "http://broker", "an address such as mqtt://host:port"),
    ("IVEG_MQTT_URL", "mqtt://broker:99999", "an address such as mqtt://host:port"),
    ("IVEG_ORION_URL", "mqtt://orion", "an address such as http://host:port"),
    ("IVEG_FIWARE_SERVICE", "Agro Connect", "1 to 50 of a-z, 0-9 and _"),
    ("IVEG_FIWARE_SERVICEPATH", "greenhouse", "a path such as /greenhouse"),
    ("IVEG_APIKEY", "a/b", "1 to 64 letters, digits, _ and -"),
    ("IVEG_ROBOTS", "AGI,AGI", "different names"),
    ("IVEG_ROBOTS", "climate", "different names"),
    ("IVEG_ROBOTS", "AGI,<b>", "different names"),
    ("IVEG_ROBOTS", "D1,D1:recording", "different names"),
    ("IVEG_ROBOTS", "D1:played", ":recording behind it"),
    ("IVEG_DATABASE_URL", "mysql://x/y", "an SQLAlchemy address"),
    ("IVEG_CONFIDENCE_THRESHOLD", "nan", _SHARE),
    ("IVEG_SAFETY_RADIUS_M", "inf", _RADIUS),
    ("IVEG_SAFETY_RADIUS_M", "2,robot=7", _RADIUS),
    ("IVEG_SAFETY_RADIUS_M", "2,crate=3", _RADIUS),
    ("IVEG_SAFETY_RADIUS_M", "2,robot=3,robot=4", _RADIUS),
    ("IVEG_STOP_DIRECT", "yes", "on or off"),
    ("IVEG_FEEDBACK_SLOW_S", "0", "a number from 0.1 to 10"),
    ("IVEG_KEEP_TELEMETRY_DAYS", "-1", "whole days from 0, for ever, to 36500"),
    ("IVEG_KEEP_DECISIONS_DAYS", "0.5", "whole days from 0"),
    ("IVEG_KEEP_POSITIONS_DAYS", "366", "no longer than IVEG_KEEP_DECISIONS_DAYS"),
    ("IVEG_KEEP_AUDIT_DAYS", "364", "no shorter than IVEG_KEEP_DECISIONS_DAYS"),
    ("IVEG_KEEP_RECORDINGS_GB", "2.5", "a whole number of gigabytes from 0"),
    ("IVEG_SIGN_IN_NAME", "Ana <admin>", "1 to 64 visible characters, none of"),
    ("IVEG_SIGN_IN_NAME", "An\u202ea", "1 to 64 visible characters"),
    ("IVEG_SSO_ISSUER", "http://idm.test", "an https address, or one of this machine"),
    ("IVEG_SSO_ROLES", "growers=owner", "values of the claim and roles"),
    ("IVEG_SSO_ROLES", "a=admin,a=viewer", "values of the claim and roles"),
    ("IVEG_ON_LINK_LOSS", "drive", "one of stop, slow"),
]
SECRET = [
    ("IVEG_NOTIFY_TOKEN", "short", "32 to 128 hexadecimal digits"),
    ("IVEG_SIGN_IN_TOKEN", "guess-me", "32 to 128 hexadecimal digits"),
    ("IVEG_API_TOKEN", "has space inside it", "16 to 256 visible characters"),
]


def sentence(variable: str, value: str) -> str:
    with pytest.raises(SettingsError) as caught:
        Settings.from_environment({variable: value})
    return str(caught.value)


@pytest.mark.parametrize(("variable", "value", "allowed"), BAD)
def test_a_bad_value_is_one_sentence_with_setting_value_and_what_is_allowed(
    variable: str, value: str, allowed: str
) -> None:
    told = sentence(variable, value)

    assert told.startswith(f"{variable}={value!r} cannot be used: it must be ")
    assert allowed in told
    assert "\n" not in told


@pytest.mark.parametrize(("variable", "value", "allowed"), SECRET)
def test_a_bad_secret_is_told_without_the_secret(
    variable: str, value: str, allowed: str
) -> None:
    told = sentence(variable, value)

    assert value not in told
    assert allowed in told


@pytest.mark.parametrize("variable", ["IVEG_MQTT_URL", "IVEG_DATABASE_URL"])
def test_a_password_inside_an_address_is_not_told(variable: str) -> None:
    told = sentence(variable, "ftp://iveg:s3cr3t@host/x")

    assert "s3cr3t" not in told
    assert "ftp://(hidden)@host/x" in told


def test_a_robot_stands_later_than_it_slows() -> None:
    with pytest.raises(SettingsError, match="more than IVEG_FEEDBACK_SLOW_S"):
        Settings.from_environment({"IVEG_FEEDBACK_SLOW_S": "3.0"})


def test_what_is_kept_for_ever_is_kept_longer_than_all_else() -> None:
    for_ever = {"IVEG_KEEP_DECISIONS_DAYS": "0", "IVEG_KEEP_POSITIONS_DAYS": "4000"}

    kept = Settings.from_environment(for_ever | {"IVEG_KEEP_AUDIT_DAYS": "0"}).retention

    assert (kept.decisions, kept.positions, kept.audit) == (0, 4000, 0)
    with pytest.raises(SettingsError, match=r"IVEG_KEEP_AUDIT_DAYS='400' .* shorter"):
        Settings.from_environment(for_ever)


def test_an_empty_environment_gives_the_defaults_of_the_contract() -> None:
    settings = Settings.from_environment({})

    assert (settings.host, settings.port) == ("127.0.0.1", 8000)
    assert load_fleet(settings.fleet, settings.robots).ids == ("AGI", "AGII")
    assert settings.rule == Parameters()
    assert (settings.stop_direct, settings.direct_read) == (True, "all")
    assert settings.fiware_service == "agroconnect"
    assert settings.greenhouse == "mvsim-20x20"


GOOD = {
    "IVEG_HOST": "0.0.0.0",  # noqa: S104 - read, not bound
    "IVEG_PORT": "8080",
    "IVEG_MQTT_URL": "mqtts://user:pass@broker:8884",
    "IVEG_MQTT_USER": "iveg",
    "IVEG_MQTT_PASSWORD": "pa,ss wörd",
    "IVEG_MQTT_CA": "/etc/iveg/ca.crt",
    "IVEG_MQTT_CERT": "/etc/iveg/iveg.crt",
    "IVEG_MQTT_KEY": "/etc/iveg/iveg.key",
    "IVEG_ORION_URL": "http://orion:1026",
    "IVEG_IOTA_URL": "https://iota",
    "IVEG_IOTA_CB_URL": "http://orion.internal:1026",
    "IVEG_NOTIFY_URL": "http://iveg:8000/ngsi/notifications",
    "IVEG_NOTIFY_TOKEN": "ab" * 32,
    "IVEG_FIWARE_SERVICE": "farm_1",
    "IVEG_FIWARE_SERVICEPATH": "/a/b",
    "IVEG_FIWARE_TOKEN_URL": "http://keyrock:3005/oauth2/token",
    "IVEG_FIWARE_CLIENT_ID": "iveg",
    "IVEG_FIWARE_CLIENT_SECRET": "of the client",
    "IVEG_FIWARE_USER": "iveg@coop.test",
    "IVEG_FIWARE_PASSWORD": "of the user",
    "IVEG_FIWARE_SCOPE": "permanent",
    "IVEG_FIWARE_TOKEN_HEADER": "X-Auth-Token",
    "IVEG_APIKEY": "key-1",
    "IVEG_ROBOTS": "AGI,AGII,D1:recording",
    "IVEG_REFUSED_ROBOTS": "AGII",
    "IVEG_DATABASE_URL": "postgresql+psycopg://u:p@db/iveg",
    "IVEG_DATA_DIRECTORY": "/var/lib/iveg",
    "IVEG_API_TOKEN": "a-long-enough-token!",
    "IVEG_SIGN_IN_TOKEN": "cd" * 32,
    "IVEG_SIGN_IN": "accounts",
    "IVEG_SIGN_IN_NAME": "Ana Núñez",
    "IVEG_SSO_ISSUER": "https://idm.test/realms/coop/",
    "IVEG_SSO_CLIENT_ID": "iveg",
    "IVEG_SSO_CLIENT_SECRET": "of the client",
    "IVEG_SSO_SCOPES": "openid",
    "IVEG_SSO_ROLE_CLAIM": "realm_access.roles",
    "IVEG_SSO_ROLES": "growers=operator,owners = admin",
    "IVEG_SSO_NAME_CLAIM": "preferred_username",
    "IVEG_SSO_LABEL": "Cooperativa",
    "IVEG_CONFIDENCE_THRESHOLD": "0.75",
    "IVEG_SAFETY_RADIUS_M": "2.0,robot=3.0",
    "IVEG_FORESIGHT": "off",
    "IVEG_FORESIGHT_S": "2.0",
    "IVEG_STOP_DIRECT": "off",
    "IVEG_DIRECT_READ": "OFF",
    "IVEG_FEEDBACK_SLOW_S": "0.5",
    "IVEG_FEEDBACK_STAND_S": "2.0",
    "IVEG_ON_LINK_LOSS": "slow",
    "IVEG_KEEP_POSITIONS_DAYS": "3",
    "IVEG_KEEP_TELEMETRY_DAYS": "0",
    "IVEG_KEEP_DECISIONS_DAYS": "100",
    "IVEG_KEEP_AUDIT_DAYS": "500",
    "IVEG_RECORDINGS": "off",
    "IVEG_KEEP_RECORDINGS_DAYS": "3",
    "IVEG_KEEP_RECORDINGS_GB": "0",
    "IVEG_KEEP_PICTURES_GB": "1",
    "IVEG_GREENHOUSE": "none",
    "IVEG_MESSAGES_FILE": "messages.toml",
    "IVEG_EQUIPMENT": "demo",
    "IVEG_FLEET": "/etc/iveg/fleet.toml",
}


@pytest.mark.parametrize(
    ("also", "name"),
    [
        ({}, "IVEG_SSO_CLIENT_ID"),
        ({"IVEG_FIWARE_TOKEN_URL": "http://a/token"}, "IVEG_FIWARE_CLIENT_ID"),
        ({"IVEG_SSO_CLIENT_ID": "iveg"}, "IVEG_SSO_ROLES"),
        ({"IVEG_SSO_ISSUER": "https://u:p@idm.test"}, "IVEG_SSO_ISSUER"),
    ],
)
def test_an_identity_provider_is_told_with_all_that_it_needs(
    also: dict[str, str], name: str
) -> None:
    environment = {"IVEG_SSO_ISSUER": "https://idm.test", **also}

    with pytest.raises(SettingsError, match=f"^{name}=") as caught:
        Settings.from_environment(environment)

    assert "u:p" not in str(caught.value)


def test_inputs_and_pictures_have_limits_of_their_own() -> None:
    settings = Settings.from_environment({"IVEG_KEEP_RECORDINGS_DAYS": "3"})
    limits = RecordingLimits(3, 6 * 10**9), RecordingLimits(3, 4 * 10**9)

    assert settings.limits_of_recordings == limits


def test_every_setting_can_be_set() -> None:
    settings = Settings.from_environment(GOOD)

    written, defaults = settings.to_environment(), Settings().to_environment()
    assert set(GOOD) == set(written)
    assert not written.items() & defaults.items()


@pytest.mark.parametrize("environment", [{}, GOOD], ids=["defaults", "all set"])
def test_a_child_process_gets_the_same_settings(environment: dict[str, str]) -> None:
    settings = Settings.from_environment(environment)

    assert Settings.from_environment(settings.to_environment()) == settings
