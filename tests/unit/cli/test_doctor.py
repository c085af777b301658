from dataclasses import replace

import pytest

from iveg.cli.diagnosis import DiagnosisRow, exit_code, judge, missing, table
from iveg.cli.findings import Finding, Lag, Stack
from iveg.domain.hops import NEEDS, Check

STACK = Stack(
    broker="broker:1883",
    user="iveg_dss",
    orion="http://orion:1026",
    agent="http://iot-agent:4041",
    listener="http://here:40000/",
    database="postgresql://db/iveg",
    page="http://here:8000",
    topics="/iveg/iveg-doctor/",
    token="http://idm:3005/oauth2/token",
)


def found(**input_faults: str | None) -> dict[Check, Finding]:
    """Every hop well, but for those that are named with what was said."""
    named = {Check[name]: said for name, said in input_faults.items()}
    return {check: Finding(check, 0.012, named.get(check)) for check in Check}


def row(check: Check, findings: dict[Check, Finding]) -> DiagnosisRow:
    return next(one for one in judge(findings, STACK) if one.check == check)


def test_a_whole_chain_is_ok_in_every_row_and_says_nothing() -> None:
    rows = judge(found(), STACK)

    assert [one.check for one in rows] == list(Check)
    assert {(one.state, one.sentence) for one in rows} == {("ok", "")}
    assert exit_code(rows) == 0


@pytest.mark.parametrize("check", Check)
@pytest.mark.parametrize("said", ["", "went wrong"])
def test_any_failure_is_one_sentence_and_exit_code_1(check: Check, said: str) -> None:
    findings = found(**{check.name: said})

    failed = row(check, findings)

    assert failed.state == "failed"
    assert (said or "nothing came in 0.0 s") in failed.sentence
    assert failed.sentence.endswith(".")
    assert exit_code(judge(findings, STACK)) == 1


@pytest.mark.parametrize("check", [check for check in Check if NEEDS[check]])
def test_a_hop_is_not_tried_where_what_it_stands_on_failed(check: Check) -> None:
    need = NEEDS[check][0]
    findings = found(**{need.name: "down"})
    del findings[check]

    assert missing(check, findings) == (need,)
    assert row(check, findings).state == "not tried"
    assert row(check, findings).sentence == f"Stands on “{need}”."


def test_what_a_hop_stands_on_is_examined_before_it() -> None:
    order = list(Check)

    assert all(
        order.index(need) < order.index(check)
        for check in Check
        for need in NEEDS[check]
    )


def test_an_examination_that_was_broken_off_is_no_success() -> None:
    findings = {Check.BROKER: Finding(Check.BROKER, 0.01)}

    rows = judge(findings, STACK)

    assert {one.state for one in rows if one.check != Check.BROKER} == {"not tried"}
    assert exit_code(rows) == 1


def test_a_wrong_password_points_at_the_password_and_not_at_the_broker() -> None:
    refused = row(Check.BROKER, found(BROKER="[code:135] Not authorized"))
    away = row(Check.BROKER, found(BROKER="Connection refused"))

    assert "IVEG_MQTT_PASSWORD" in refused.sentence
    assert "iveg_dss" in refused.sentence
    assert "IVEG_MQTT_URL" in away.sentence


@pytest.mark.parametrize("name", ["ORION", "AGENT"])
def test_a_token_that_cannot_be_had_is_told_from_one_that_a_proxy_refuses(
    name: str,
) -> None:
    check = Check[name]
    said = {
        "no_token": "token endpoint down: no answer in 5 s",
        "refused": "401 to GET /version: User access-token not authorized",
        "no_role": "403 to GET /version",
        "away": "cannot be reached: ConnectError",
    }
    rows = {one: row(check, found(**{name: why})).sentence for one, why in said.items()}

    assert rows["no_token"].startswith("There is no bearer for ")
    assert STACK.token in rows["no_token"]
    assert rows["refused"].startswith("A proxy before ")
    assert rows["no_role"].startswith("A proxy before ")
    assert rows["away"].startswith("No ")


def test_a_broker_without_echo_points_at_the_access_list() -> None:
    silent = row(Check.BROKER, found(BROKER="gives no echo of what we publish"))

    assert "access list" in silent.sentence
    assert "/iveg/iveg-doctor/#" in silent.sentence


def test_an_agent_that_sends_and_receives_nothing_is_named() -> None:
    receives_nothing = row(Check.MEASURE, found(MEASURE="", ANSWER=""))
    cut_off = row(Check.MEASURE, found(MEASURE="", COMMAND=""))

    assert "receives nothing" in receives_nothing.sentence
    assert "receives nothing" not in cut_off.sentence
    assert "IVEG_IOTA_CB_URL" in cut_off.sentence


def test_overload_is_named_before_address_tenant_or_database() -> None:
    behind = replace(STACK, lag=Lag(23.4, growing=True))
    findings = found(
        AGENT="no answer to GET /iot/about in 3 s", MEASURE="", COMMAND="404"
    )
    rows = {one.check: one.sentence for one in judge(findings, behind)}

    assert rows[Check.MEASURE].startswith("Measures reach Orion 23 s late, growing (")
    assert "overloaded" in rows[Check.AGENT]
    assert "IOTA_PROVIDER_URL" not in rows[Check.COMMAND]


def test_a_measure_that_never_came_is_at_least_so_late_or_never() -> None:
    waited = replace(STACK, waited_s=15.0)
    (lost,) = [
        one.sentence
        for one in judge(found(MEASURE=""), waited)
        if one.check == Check.MEASURE
    ]

    assert lost.startswith("Measures reach Orion at least 15 s late, or never (")


def test_a_measure_that_comes_late_is_well_and_says_how_late() -> None:
    findings = {**found(), Check.MEASURE: Finding(Check.MEASURE, 2.34)}

    late = row(Check.MEASURE, findings)

    assert (late.state, late.sentence) == ("ok", "Measures reach Orion 2.3 s late.")


def test_behind_an_agent_that_is_late_hops_are_not_tried_and_say_why() -> None:
    findings = found(MEASURE="told")
    del findings[Check.COMMAND]
    (command,) = [
        one
        for one in judge(findings, replace(STACK, lag=Lag(23.0)))
        if one.check == Check.COMMAND
    ]

    assert (command.state, command.sentence) == (
        "not tried",
        "The agent is behind: nothing is added.",
    )


@pytest.mark.parametrize("check", [Check.AGENT, Check.DEVICE])
def test_an_agent_that_is_silent_is_not_called_misconfigured(check: Check) -> None:
    silent = row(check, found(**{check.name: "no answer to POST /iot/services in 6 s"}))

    assert "overloaded or hung" in silent.sentence
    assert "MongoDB" not in silent.sentence


def test_a_404_that_took_orions_patience_is_an_agent_that_is_silent() -> None:
    slow = {**found(), Check.COMMAND: Finding(Check.COMMAND, 5.0, "404 to PATCH")}

    assert "overloaded or hung" in row(Check.COMMAND, slow).sentence


def test_orions_404_to_a_command_is_read_as_an_agent_out_of_reach() -> None:
    refused = row(Check.COMMAND, found(COMMAND="404 to PATCH /v2/entities"))
    lost = row(Check.COMMAND, found(COMMAND=""))

    assert "IOTA_PROVIDER_URL" in refused.sentence
    assert "may write /iveg/iveg-doctor/cmd" in lost.sentence


def test_a_database_that_only_needs_migrating_says_so() -> None:
    old = row(Check.DATABASE, found(DATABASE="run `iveg db upgrade`"))
    away = row(Check.DATABASE, found(DATABASE="connection refused"))

    assert "cannot be used yet" in old.sentence
    assert "IVEG_DATABASE_URL" in away.sentence


def test_the_table_shows_milliseconds_and_the_sentence_under_its_row() -> None:
    lines = table(judge(found(PAGE="refused"), STACK)).splitlines()

    assert lines[0].split() == ["hop", "state", "ms"]
    assert lines[1].split()[-2:] == ["ok", "12"]
    assert lines[-2].startswith(str(Check.PAGE))
    assert lines[-2].split()[-2:] == ["failed", "12"]
    assert lines[-1].startswith("    iVeg itself does not answer at http://here:8000")
