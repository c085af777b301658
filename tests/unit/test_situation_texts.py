"""What pages say of a fleet: no two texts contradict, and one line says enough.

The page's own pure functions write the texts, in a browser, of robots as the server
told them; ``tests.worlds`` lives the days, and the page also grows old by itself.
"""

import re
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from playwright.sync_api import Browser, Page

from iveg.domain.limits import LIMITS
from iveg.domain.situation import ALERTED
from iveg.web.pages.sentences import read_translations
from tests import staged
from tests.staged import STAGED
from tests.unit.test_js_modules import browser, files
from tests.worlds import Moment, days, told

__all__ = ["browser", "files"]

SAY = """async ([robots, waitedS, language, people]) => {
  const {all} = await import('/tests/js/surfaces.js');
  return all(robots, waitedS, language, people);
}"""


@pytest.fixture(scope="module")
def page(browser: Browser, files: str) -> Iterator[Page]:
    opened = browser.new_page()
    opened.goto(files)
    yield opened
    opened.close()


def contradictions(one: dict[str, Any]) -> dict[str, bool]:
    """What must not stand beside each other on the surfaces of one robot, by name."""
    is_clear = "situation.is.clear" in one["said"]
    slow = "situation.is.half" in one["said"] or "situation.is.slow" in one["said"]
    locked = "situation.is.held" in one["said"]
    return {
        "clear, and a link that is not": is_clear and one["link"] != "LIVE",
        "clear, and a limit": is_clear and one["factor"] != 1.0,
        "slow, and limit 0.00": slow and one["factor"] == 0.0,
        "locked, and no locks": locked and not one["locks"],
        "locked, and a limit": locked and one["factor"] != 0.0,
        "a padlock, and not locked": one["padlock"] and one["level"] != "locked",
        "slow on the map alone": bool(one["pill"]) and not slow,
        "a fleet page of its own": one["row"].lower() != one["line"].lower(),
        "a silent robot at work": one["link"] in ("LOST", "UNKNOWN")
        and one["level"] in ("working", "locked"),
    }


def of_people(
    fleet: dict[str, Any], people: list[dict[str, Any]], waited_s: float
) -> dict[str, bool]:
    """The same of the people over the map."""
    seen = [
        one
        for one in people
        if (one["class"], one["stage"]) == ("person", "seen")
        and one["age_s"] + waited_s <= LIMITS.seen_s
    ]
    counted = re.match(r"map\.people_(?:one|count) (\d+)", fleet["people"])
    return {
        "seen, and nobody sees them": int(counted[1] if counted else 0) != len(seen),
        "seen, and no camera": bool(re.search(r"people_(one|count)", fleet["blind"])),
        "people, and no server": fleet["gone"] != "map.people_no_link",
    }


def of_alerts(fleet: dict[str, Any], moment: Moment) -> dict[str, bool]:
    """The same of the active P1 alerts; one of silence ends with the next tick.

    The server told that a robot is heard again, whatever has become of the page since.
    """
    found = {}
    heard = {one["robot_id"] for one in moment.robots if one["link"] == "LIVE"}
    for robot, one in ((one["robot"], one) for one in fleet["robots"]):
        states = {ALERTED[key][1] for name, key in moment.alerts if name == robot}
        if robot in heard:
            states.discard("lost_moving")
        said = one["said"].removeprefix("situation.is.").split(" ")[0]
        found[f"an alert, and {robot} says something else"] = (
            bool(states) and said not in states
        )
    return found


def of_fleet(fleet: dict[str, Any]) -> dict[str, bool]:
    """The same of the status line, the chip and the health sentence."""
    robots = fleet["robots"]
    live = all(one["link"] == "LIVE" for one in robots)
    worst = {one["level"] for one in robots}
    return {
        "all works, and not all are live": "fleet.whole" in fleet["chain"] and not live,
        "a chip in order, and not all live": fleet["chip"] == "ok" and not live,
        "all clear, and somebody is not": "fleet.clear" in fleet["status"]
        and any("situation.is.clear" not in one["said"] for one in robots),
        "danger that is not said": "danger" in worst and fleet["level"] != "danger",
        "quiet above something bad": fleet["level"] in ("working", "away")
        and bool(worst & {"danger", "caution", "doubt", "locked"}),
        "red for nothing": fleet["level"] == "danger" and "danger" not in worst,
    }


@settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(days, st.sampled_from((0.0, 0.0, 0.9, 1.4, 4.0)))
@example([("drive", "AGI", 0.0, 0.3), ("wait", 3.5), ("drive", "AGI", 0.0, 0.0)], 1.4)
def test_no_two_texts_of_one_robot_contradict(
    page: Page, day: list[tuple[Any, ...]], waited_s: float
) -> None:
    with ThreadPoolExecutor(1) as aside:  # the browser's loop runs in this one
        moments = aside.submit(told, day).result()
    for moment in moments:
        told_now = [moment.robots, waited_s, "", moment.people]
        fleet = page.evaluate(SAY, told_now)
        for one in fleet["robots"]:
            found = [name for name, holds in contradictions(one).items() if holds]
            assert found == [], one
        others = {
            **of_fleet(fleet),
            **of_people(fleet, moment.people, waited_s),
            **of_alerts(fleet, moment),
        }
        assert [name for name, holds in others.items() if holds] == [], fleet


# --- one wording ----------------------------------------------------------------------

OF_STOP = {
    "sent": "stopping",
    "delivered": "braking",
    "still_moving": "still_moving",
    "moved": "moved",
    "stale": "stood",
    "ready": "ready",
}
OF_SPEED = {
    **{reason: reason for reason in ("stale", "watchdog", "obstacle", "unsupervised")},
    "doubt": "no_doubt",
    "detector": "no_detector",
}


@pytest.mark.parametrize("language", ["es", "en"])
def test_alerts_and_the_log_have_the_words_of_the_situation(language: str) -> None:
    said = read_translations(language).sentences
    for key, (_, state, _) in ALERTED.items():
        if not said.get(key, "").startswith("{robot}"):
            continue
        plain = re.sub(r"(?: desde)? \w+ {age:span}", "", said[f"situation.is.{state}"])
        assert said[key].casefold().startswith(f"{{robot}}: {plain}".casefold())
    for step, state in OF_STOP.items():
        whole = f"{{robot}}: {said[f'situation.is.{state}']}"
        assert said[f"log.stop.{step}"].casefold() == whole.casefold()
    for reason, why in OF_SPEED.items():
        cause = said[f"situation.why.{why}"].replace("{about}", "{observer}")
        assert said[f"log.speed_down.{reason}"].endswith(f": {cause}")


# --- ten seconds ----------------------------------------------------------------------

_NAMES = ("AGI", "AGII", *(f"R{n}" for n in range(3, 11)))


def fleet_of(*names: str) -> list[dict[str, Any]]:
    """A robot in each of these staged situations."""
    return [
        {
            "robot_id": robot,
            "age_s": STAGED[name][0].age_s,
            "situation": staged.told(STAGED[name][0]),
            "holds": [],
            "margin": None,
            "twist": None,
        }
        for robot, name in zip(_NAMES, names, strict=False)
    ]


def status_of(page: Page, language: str, *names: str) -> str:
    said: str = page.evaluate(SAY, [fleet_of(*names), 0.0, language])["status"]
    return said


@pytest.mark.parametrize("language", ["es", "en"])
@pytest.mark.parametrize("name", STAGED)
def test_the_status_line_alone_names_robot_danger_and_action(
    page: Page, name: str, language: str
) -> None:
    _, level, *sentences = STAGED[name]
    said = page.evaluate(SAY, [fleet_of(name), 0.0, language])

    assert said["level"] == level
    words = sentences[language == "en"]
    assert [part for part in ("AGI", *words) if part not in said["status"]] == []
    assert len(said["status"]) <= 86, "two lines of a phone"
    calls = ("PARAR", "STOP")[language == "en"]
    assert (
        f"{'pulse' if language == 'es' else 'press'} {calls}" in said["status"]
    ) == (name == "does not slow")


ALONE = {"does not slow"}
"""Situations of which each is told by itself: where somebody is comes first."""


@pytest.mark.parametrize("language", ["es", "en"])
@pytest.mark.parametrize("name", STAGED)
def test_one_sentence_tells_all_robots_that_stand_alike(
    page: Page, name: str, language: str
) -> None:
    for count in (2, 5, 10):
        names = [name] * count + ["all clear"] * (10 - count)
        said = status_of(page, language, *names)

        assert len(said) <= 86, said
        if name == "all clear":
            continue
        alone, named = f"AGI: {said.partition(': ')[2]}", "AGI, AGII: "
        if name in ALONE:
            assert said == alone
        elif count == 2:
            assert said.startswith(named)
        else:
            assert re.match(rf"(All |Los )?{count} robots( \(AGI, AGII…\))?: ", said)


def test_of_several_alike_most_are_told_and_in_danger_the_first(page: Page) -> None:
    stopped = "stopped from a page"
    said = status_of(page, "en", "red button", stopped, stopped, stopped)
    assert said.startswith("AGII, R3, R4: locked by STOP")
    lost = "lost while moving"
    said = status_of(page, "en", "does not slow", lost, lost, "all clear")
    assert said.startswith("AGI: does not slow down: person in aisle 3")
    assert said.endswith("(+2 in danger)")
    said = status_of(page, "en", lost, lost, "does not slow")
    assert said.startswith("R3: does not slow down")
    assert said.endswith("(+2 in danger)")
