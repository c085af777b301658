"""States of the STOP control (docs/dashboard.md) that take a fault that is real.

AGI is the emulator's; AGV is a puppet whose brakes and words obey the test.
One stack serves all tests, so each leaves it as it found it.
"""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.e2e.conftest import OpenPage, live_page
from tests.e2e.hands import ask, begin_hold, let_go, look, open_menu
from tests.e2e.puppet import CRUISE, Puppet, described, puppet
from tests.e2e.reading import STANDING, card, evaluate, strip_stop
from tests.processes import EMULATOR, Site, site, until

pytestmark = [pytest.mark.e2e, pytest.mark.slow]

STEPS = "asked", "acknowledged", "standing"

_WATCH = """([robot]) => {
  const control = document.querySelector(`#stops [data-stop="${robot}"]`);
  const said = [];
  const look = () => {
    const words = control.querySelector('.stop__label').textContent;
    said.push([control.dataset.state, words, control.innerText]);
  };
  const options = {subtree: true, childList: true, characterData: true,
                   attributes: true, attributeFilter: ['data-state']};
  new MutationObserver(look).observe(control, options);
  window.__said = said;
}"""


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    directory = tmp_path_factory.mktemp("stop")
    settings = {"IVEG_ROBOTS": "AGI,AGV", "IVEG_FLEET": described(directory, "AGV")}
    with site(directory, **settings) as place:
        place.serve()
        place.start(*EMULATOR, "--robots", "1")
        place.wait_until_live(robots=1)
        yield place


@pytest.fixture(scope="module")
def strings(stack: Site) -> Iterator[Puppet]:
    with puppet("AGV", stack.settings["IVEG_MQTT_URL"]) as robot:
        yield robot


@pytest.fixture(scope="module")
def page(browser: Browser, stack: Site) -> Iterator[Page]:
    """A page with no map on it: every page has the STOP controls, and this is light."""
    with live_page(browser, stack, route="/about") as found:
        yield _listening(found)


@pytest.fixture
def agv(strings: Puppet, page: Page, stack: Site) -> Puppet:
    """The puppet, driving and obedient."""
    strings.behave()
    _make_ready(page, stack, "AGV")
    strings.speed = CRUISE
    return strings


@pytest.fixture
def agi(page: Page, stack: Site) -> Locator:
    """AGI's control, ready."""
    _make_ready(page, stack, "AGI")
    return strip_stop(page, "AGI")


# --- unconfirmed ---------------------------------------------------------------------


def test_a_lost_control_still_sends_and_says_loudly_what_nobody_confirms(
    page: Page, agi: Locator, stack: Site
) -> None:
    with stack.paused("emulator"):
        expect(agi).to_have_attribute("data-state", "lost")
        agi.click()

        expect(agi).to_contain_text("PARADA SIN CONFIRMAR — use la seta roja")
        line = page.locator("#p1 .p1__line")
        expect(line).to_contain_text(
            "AGI: PARADA SIN CONFIRMAR: use la seta roja. Estaba"
        )
        expect(line).to_contain_text("Vías: directa enviada, FIWARE en curso")
        first = _numbers(line)
        until(lambda: _numbers(line)["tries"] > first["tries"] + 1, "more tries")
        until(lambda: _numbers(line)["pressed"] > first["pressed"], "it ages")
        assert _numbers(line)["heard"] > first["heard"]

    # L1: nobody has to do anything for the truth to come back.
    expect(agi).to_contain_text(STANDING)
    expect(page.locator("#p1 .p1__line")).to_have_count(0)


# --- asked, acknowledged, standing ---------------------------------------------------


def test_asked_acknowledged_and_standing_are_three_different_words(
    page: Page, agv: Puppet
) -> None:
    agv.brakes = False
    evaluate(page, _WATCH, "AGV")
    control = strip_stop(page, "AGV")
    control.click()
    expect(control).to_contain_text("Confirmado, frenando…")
    agv.brakes = True
    expect(control).to_contain_text(STANDING)

    said: list[list[str]] = page.evaluate("window.__said")
    states = list(dict.fromkeys(state for state, *_ in said if state in STEPS))
    assert states == list(STEPS)
    asked = [words for state, words, *_ in said if state == "asked"]
    assert any(re.fullmatch(r"Parando… \d+ ms", words) for words in asked)


# --- was standing ---------------------------------------------------------------------


def test_a_standstill_that_is_no_longer_reported_turns_grey_and_counts(
    page: Page, agi: Locator, stack: Site
) -> None:
    agi.click()
    expect(agi).to_contain_text(STANDING)
    evaluate(page, _WATCH, "AGI")

    def has_counted() -> bool:
        said = " ".join(_said(page, "stale"))
        told = re.findall(r"visto parado hace (\d+) s: ahora no se sabe", said)
        return len(set(told)) > 2

    with stack.paused("emulator"):
        expect(agi).to_have_attribute("data-state", "stale")
        until(has_counted, "it counts the seconds")

    expect(agi).to_contain_text(STANDING)


# --- release --------------------------------------------------------------------------


def test_f37_who_stops_while_another_holds_the_release_wins(
    open_page: OpenPage, page: Page, agv: Puppet, stack: Site
) -> None:
    # The browser rightly notes the 409.
    other = _listening(open_page(alone=True))
    control = strip_stop(other, "AGV")
    control.click()
    expect(control).to_contain_text(STANDING)
    open_menu(other, "AGV")
    release = other.locator('[data-release="AGV"]')
    expect(release).to_be_enabled()
    begin_hold(other, release)
    # A line that comes above the button moves it from under a finger that rests.
    release.evaluate("button => button.style.marginTop = '120px'")
    # No click: on a busy machine it may take longer than a release is held.
    assert ask(page, stack, "robots/AGV/stop", {}).ok
    result = card(other, "AGV").locator('[data-part="result"]')
    expect(result).to_have_text(
        "El robot ha cambiado entretanto. Mire la lista y repita."
    )
    other.mouse.up()

    assert look(page, stack, "AGV")["stop_state"] == "STANDING"
    assert agv.speed == 0.0


# --- helpers --------------------------------------------------------------------------


def _listening(page: Page) -> Page:
    page.wait_for_selector('#mark[data-state="open"]', state="attached")
    return page


def _said(page: Page, state: str) -> list[str]:
    """What a control that is watched said in a state."""
    told: list[list[str]] = page.evaluate("window.__said")
    return [text for it, _, text in told if it == state]


def _make_ready(page: Page, stack: Site, robot: str) -> None:
    let_go(page, stack, robot)
    expect(strip_stop(page, robot)).to_have_attribute("data-state", "ready")


_SENTENCE = {
    "pressed": r"hace (\d+) s por",
    "tries": r"(\d+) intentos",
    "heard": r"informe hace ([\d,]+) s",
    "moved": r"avanzado ([\d,]+) m",
}


def _numbers(line: Locator) -> dict[str, float]:
    """What the full-width line counts."""
    text = line.inner_text()
    found = {name: re.search(hole, text) for name, hole in _SENTENCE.items()}
    assert all(found.values()), text
    return {
        name: float(match[1].replace(",", "."))
        for name, match in found.items()
        if match
    }
