from dataclasses import replace

import pytest

from iveg.cli.diagnosis import (
    NEEDS,
    Finding,
    Hop,
    Lag,
    Row,
    Stack,
    exit_code,
    judge,
    missing,
    table,
)

STACK = Stack(
    broker="broker:1883",
    user="iveg_dss",
    orion="http://orion:1026",
    agent="http://iot-agent:4041",
    listener="http://here:40000/",
    database="postgresql://db/iveg",
    page="http://here:8000",
    topics="/iveg/iveg-doctor/",
)


def found(**input_faults: str | None) -> dict[Hop, Finding]:
    """Every hop well, but for those that are named with what was said."""
    named = {Hop[name]: said for name, said in input_faults.items()}
    return {hop: Finding(hop, 0.012, named.get(hop)) for hop in Hop}


def row(hop: Hop, findings: dict[Hop, Finding]) -> Row:
    return next(one for one in judge(findings, STACK) if one.hop == hop)


def test_a_whole_chain_is_ok_in_every_row_and_says_nothing() -> None:
    rows = judge(found(), STACK)

    assert [one.hop for one in rows] == list(Hop)
    assert {(one.state, one.sentence) for one in rows} == {("ok", "")}
    assert exit_code(rows) == 0


@pytest.mark.parametrize("hop", Hop)
@pytest.mark.parametrize("said", ["", "went wrong"])
def test_any_failure_is_one_sentence_and_exit_code_1(hop: Hop, said: str) -> None:
    findings = found(**{hop.name: said})

    failed = row(hop, findings)

    assert failed.state == "failed"
    assert (said or "nothing came in 0.0 s") in failed.sentence
    assert failed.sentence.endswith(".")
    assert exit_code(judge(findings, STACK)) == 1


@pytest.mark.parametrize("hop", [hop for hop in Hop if NEEDS[hop]])
def test_a_hop_is_not_tried_where_what_it_stands_on_failed(hop: Hop) -> None:
    need = NEEDS[hop][0]
    findings = found(**{need.name: "down"})
    del findings[hop]

    assert missing(hop, findings) == (need,)
    assert row(hop, findings).state == "not tried"
    assert row(hop, findings).sentence == f"Stands on “{need}”."


def test_what_a_hop_stands_on_is_examined_before_it() -> None:
    order = list(Hop)

    assert all(
        order.index(need) < order.index(hop) for hop in Hop for need in NEEDS[hop]
    )


def test_an_examination_that_was_broken_off_is_no_success() -> None:
    findings = {Hop.BROKER: Finding(Hop.BROKER, 0.01)}

    rows = judge(findings, STACK)

    assert {one.state for one in rows if one.hop != Hop.BROKER} == {"not tried"}
    assert exit_code(rows) == 1


def test_a_wrong_password_points_at_the_password_and_not_at_the_broker() -> None:
    refused = row(Hop.BROKER, found(BROKER="[code:135] Not authorized"))
    away = row(Hop.BROKER, found(BROKER="Connection refused"))

    assert "IVEG_MQTT_PASSWORD" in refused.sentence
    assert "iveg_dss" in refused.sentence
    assert "IVEG_MQTT_URL" in away.sentence


def test_a_broker_without_echo_points_at_the_access_list() -> None:
    silent = row(Hop.BROKER, found(BROKER="gives no echo of what we publish"))

    assert "access list" in silent.sentence
    assert "/iveg/iveg-doctor/#" in silent.sentence


def test_an_agent_that_sends_and_does_not_hear_is_called_deaf() -> None:
    deaf = row(Hop.MEASURE, found(MEASURE="", ANSWER=""))
    cut_off = row(Hop.MEASURE, found(MEASURE="", COMMAND=""))

    assert "deaf" in deaf.sentence
    assert "deaf" not in cut_off.sentence
    assert "IVEG_IOTA_CB_URL" in cut_off.sentence


def test_overload_is_named_before_address_tenant_or_database() -> None:
    behind = replace(STACK, lag=Lag(23.4, growing=True))
    findings = found(
        AGENT="no answer to GET /iot/about in 3 s", MEASURE="", COMMAND="404"
    )
    rows = {one.hop: one.sentence for one in judge(findings, behind)}

    assert rows[Hop.MEASURE].startswith("Measures reach Orion 23 s late, growing (")
    assert "overloaded" in rows[Hop.AGENT]
    assert "IOTA_PROVIDER_URL" not in rows[Hop.COMMAND]


def test_a_measure_that_never_came_is_at_least_so_late_or_never() -> None:
    waited = replace(STACK, waited_s=15.0)
    (lost,) = [
        one.sentence
        for one in judge(found(MEASURE=""), waited)
        if one.hop == Hop.MEASURE
    ]

    assert lost.startswith("Measures reach Orion at least 15 s late, or never (")


def test_a_measure_that_comes_late_is_well_and_says_how_late() -> None:
    findings = {**found(), Hop.MEASURE: Finding(Hop.MEASURE, 2.34)}

    late = row(Hop.MEASURE, findings)

    assert (late.state, late.sentence) == ("ok", "Measures reach Orion 2.3 s late.")


def test_behind_an_agent_that_is_late_hops_are_not_tried_and_say_why() -> None:
    findings = found(MEASURE="told")
    del findings[Hop.COMMAND]
    (command,) = [
        one
        for one in judge(findings, replace(STACK, lag=Lag(23.0)))
        if one.hop == Hop.COMMAND
    ]

    assert (command.state, command.sentence) == (
        "not tried",
        "The agent is behind: nothing is added.",
    )


@pytest.mark.parametrize("hop", [Hop.AGENT, Hop.DEVICE])
def test_an_agent_that_is_silent_is_not_called_misconfigured(hop: Hop) -> None:
    silent = row(hop, found(**{hop.name: "no answer to POST /iot/services in 6 s"}))

    assert "overloaded or hung" in silent.sentence
    assert "MongoDB" not in silent.sentence


def test_a_404_that_took_orions_patience_is_an_agent_that_is_silent() -> None:
    slow = {**found(), Hop.COMMAND: Finding(Hop.COMMAND, 5.0, "404 to PATCH")}

    assert "overloaded or hung" in row(Hop.COMMAND, slow).sentence


def test_orions_404_to_a_command_is_read_as_an_agent_out_of_reach() -> None:
    refused = row(Hop.COMMAND, found(COMMAND="404 to PATCH /v2/entities"))
    lost = row(Hop.COMMAND, found(COMMAND=""))

    assert "IOTA_PROVIDER_URL" in refused.sentence
    assert "may write /iveg/iveg-doctor/cmd" in lost.sentence


def test_a_database_that_only_needs_migrating_says_so() -> None:
    old = row(Hop.DATABASE, found(DATABASE="run `iveg db upgrade`"))
    away = row(Hop.DATABASE, found(DATABASE="connection refused"))

    assert "cannot be used yet" in old.sentence
    assert "IVEG_DATABASE_URL" in away.sentence


def test_the_table_shows_milliseconds_and_the_sentence_under_its_row() -> None:
    lines = table(judge(found(PAGE="refused"), STACK)).splitlines()

    assert lines[0].split() == ["hop", "state", "ms"]
    assert lines[1].split()[-2:] == ["ok", "12"]
    assert lines[-2].startswith(str(Hop.PAGE))
    assert lines[-2].split()[-2:] == ["failed", "12"]
    assert lines[-1].startswith("    iVeg itself does not answer at http://here:8000")
