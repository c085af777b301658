"""Every state of the STOP control (docs/dashboard.md), each by a fault that is real.

AGI is the emulator's; AGV is a puppet whose brakes and words obey the test.
One stack serves all tests, so each leaves it as it found it.
"""

import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.e2e.conftest import OpenPage, live_page
from tests.e2e.hands import ask, begin_hold, let_go, look, open_menu
from tests.e2e.puppet import CRUISE, Puppet, described, puppet
from tests.e2e.reading import card, evaluate, strip_stop
from tests.processes import EMULATOR, Program, Site, site, until

pytestmark = [pytest.mark.e2e, pytest.mark.slow]

STANDING = re.compile(r"PARADO \(hace [\d,]+ s\)")

_WATCH = """([robot]) => {
  const control = document.querySelector(`#stops [data-stop="${robot}"]`);
  const said = [];
  const look = () => {
    const words = control.querySelector('.stop__label').textContent;
    const outline = getComputedStyle(control, '::after').display;
    said.push([control.dataset.state, words, control.innerText, outline]);
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
        place.start("fiware").wait_until_ready()
        place.start("serve")
        place.wait_until_served()
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


@pytest.fixture
def english(open_page: OpenPage) -> Page:
    """The same page in English."""
    return _listening(open_page(locale="en-GB", route="/about"))


# --- the link ------------------------------------------------------------------------


def test_a_control_whose_script_has_not_run_does_not_look_as_if_it_stopped(
    open_page: OpenPage, stack: Site
) -> None:
    page = open_page(alone=True)
    page.route("**/main.js", lambda route: route.abort())
    page.goto(f"{stack.url}/about")

    control = strip_stop(page, "AGI")
    expect(control).to_have_attribute("data-state", "lost")
    expect(control).to_contain_text("Cargando… Si tarda: seta roja")


def test_ready_is_a_red_octagon_that_names_what_it_stops(
    agi: Locator, english: Page
) -> None:
    expect(agi).to_have_attribute("data-state", "ready")
    expect(agi).to_have_text("PARAR AGI", use_inner_text=True)
    expect(strip_stop(english, "AGI")).to_have_text("STOP AGI", use_inner_text=True)
    assert "polygon" in _style(agi, "clipPath", "::before")


def test_a_late_link_has_amber_and_its_age_and_a_lost_one_is_hatched_and_crossed(
    page: Page, agi: Locator, english: Page, stack: Site
) -> None:
    in_english = strip_stop(english, "AGI")
    evaluate(page, _WATCH, "AGI")
    with _frozen(stack, "emulator"):
        expect(agi).to_have_attribute("data-state", "lost")
        late = [(text, outline) for text, outline in _said(page, "late") if "(" in text]
        assert re.search(r"PARAR AGI\s+\(enlace lento [1-3] s\)", late[0][0])
        assert {outline for _, outline in late} == {"block"}
        expect(agi).to_contain_text("SIN ENLACE — use la seta roja del robot")
        expect(in_english).to_contain_text("NO LINK — use the red button on the robot")
        assert "repeating-linear-gradient" in _style(agi, "backgroundImage", "::before")
        assert "×" in _style(agi.locator(".stop__who"), "content", "::before")

    expect(agi).to_have_attribute("data-state", "ready")


# --- unconfirmed ---------------------------------------------------------------------


def test_a_lost_control_still_sends_and_says_loudly_what_nobody_confirms(
    page: Page, agi: Locator, english: Page, stack: Site
) -> None:
    with _frozen(stack, "emulator"):
        expect(agi).to_have_attribute("data-state", "lost")
        agi.click()

        expect(agi).to_contain_text("PARADA SIN CONFIRMAR — use la seta roja")
        expect(strip_stop(english, "AGI")).to_contain_text(
            "STOP NOT CONFIRMED — use the red button"
        )
        line = page.locator("#p1 .p1__line")
        expect(line).to_contain_text("AGI: PARADA SIN CONFIRMAR: use la seta roja")
        expect(line).to_contain_text(re.compile(r"Pulsado hace \d+ s por operador"))
        expect(line).to_contain_text(re.compile(r"Último informe hace [\d,]+ s, a"))
        expect(line).to_contain_text("Vías: directa enviada, FIWARE en curso")
        expect(english.locator("#p1 .p1__line")).to_contain_text(
            re.compile(r"Pressed \d+ s ago by operator, \d+ tries")
        )
        box = line.bounding_box()
        assert box is not None
        assert box["width"] > 1300
        first = _numbers(line)
        until(lambda: _numbers(line)["tries"] > first["tries"] + 1, "more tries")
        until(lambda: _numbers(line)["pressed"] > first["pressed"], "it ages")
        later = _numbers(line)
        assert later["pressed"] > first["pressed"]
        assert later["heard"] > first["heard"]

    # L1: nobody has to do anything for the truth to come back.
    expect(agi).to_contain_text(STANDING)
    expect(page.locator("#p1 .p1__line")).to_have_count(0)


def test_a_deaf_robot_drives_on_and_the_page_says_how_far_it_may_be(
    page: Page, agv: Puppet
) -> None:
    agv.answers = agv.brakes = False
    agv.speaks = False
    strip_stop(page, "AGV").click()

    line = page.locator("#p1 .p1__line")
    expect(line).to_contain_text("a 0,40 m/s")
    expect(line).to_contain_text(re.compile(r"Puede haber avanzado [\d,]+ m"))
    first = _numbers(line)["moved"]
    until(lambda: _numbers(line)["moved"] > first + 0.5, "the doubt grows")

    agv.answers = agv.brakes = agv.speaks = True
    expect(strip_stop(page, "AGV")).to_contain_text(STANDING)


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
    states = list(dict.fromkeys(state for state, *_ in said if state != "ready"))
    assert states == ["asked", "acknowledged", "standing"]
    asked = [words for state, words, *_ in said if state == "asked"]
    assert any(re.fullmatch(r"Parando… \d+ ms", words) for words in asked)


def test_f40_a_robot_that_only_says_that_it_brakes_is_told_on(
    page: Page, agv: Puppet
) -> None:
    agv.brakes = False
    strip_stop(page, "AGV").click()

    control = strip_stop(page, "AGV")
    expect(control).to_contain_text("RECIBIDA PERO SE MUEVE")
    line = page.locator("#p1 .p1__line")
    expect(line).to_contain_text("AGV: RECIBIDA PERO SE MUEVE: use la seta roja")
    expect(line).to_contain_text("a 0,40 m/s")

    agv.brakes = True
    expect(control).to_contain_text(STANDING)


# --- was standing ---------------------------------------------------------------------


def test_a_standstill_that_is_no_longer_reported_turns_grey_and_counts(
    page: Page, agi: Locator, stack: Site
) -> None:
    agi.click()
    expect(agi).to_contain_text(STANDING)
    evaluate(page, _WATCH, "AGI")

    def has_counted() -> bool:
        said = " ".join(text for text, _ in _said(page, "stale"))
        return all(
            f"visto parado hace {second} s: ahora no se sabe" in said
            for second in (3, 5)
        )

    with _frozen(stack, "emulator"):
        expect(agi).to_have_attribute("data-state", "stale")
        until(has_counted, "it counts the seconds")

    expect(agi).to_contain_text(STANDING)


def test_a_held_robot_that_moves_again_is_stopped_under_a_new_id(
    page: Page, agv: Puppet, stack: Site
) -> None:
    control = strip_stop(page, "AGV")
    control.click()
    expect(control).to_contain_text(STANDING)
    before = look(page, stack, "AGV")["stop"]["command_id"]
    agv.brakes, agv.speed = False, CRUISE

    expect(control).to_contain_text("SE HA MOVIDO")
    expect(page.locator("#p1 .p1__line")).to_contain_text("AGV: SE HA MOVIDO.")
    assert look(page, stack, "AGV")["stop"]["command_id"] != before

    agv.brakes = True
    expect(control).to_contain_text(STANDING)


# --- release --------------------------------------------------------------------------


def test_nothing_is_released_on_old_news(
    open_page: OpenPage, agi: Locator, stack: Site
) -> None:
    page = _listening(open_page())
    agi.click()
    expect(agi).to_contain_text(STANDING)
    holds = [hold["id"] for hold in look(page, stack, "AGI")["holds"]]
    open_menu(page, "AGI")
    release = page.locator('[data-release="AGI"]')
    expect(release).to_be_enabled()
    with _frozen(stack, "emulator"):
        expect(release).to_be_disabled()
        expect(card(page, "AGI").locator('[data-part="release-why"]')).to_have_text(
            "Sin datos recientes del robot."
        )
        # The page counts the way of a report, too, and may call it old a little sooner.
        until(lambda: _report_age(page, stack) > 1.5, "the server's is old, too")
        body = {"holds": holds}
        assert ask(page, stack, "robots/AGI/release", body).status == 409

    expect(agi).to_contain_text(STANDING)


def _report_age(page: Page, stack: Site) -> float:
    applied = look(page, stack, "AGI")["applied"]
    return float(applied["age_s"])


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


def _said(page: Page, state: str) -> list[tuple[str, str]]:
    """What a control that is watched said in a state, and how its line displays."""
    told: list[list[str]] = page.evaluate("window.__said")
    return [(text, outline) for it, _, text, outline in told if it == state]


def _make_ready(page: Page, stack: Site, robot: str) -> None:
    let_go(page, stack, robot)
    expect(strip_stop(page, robot)).to_have_attribute("data-state", "ready")


@contextmanager
def _frozen(stack: Site, word: str) -> Iterator[None]:
    """A part that is there and does nothing, as under SIGSTOP."""
    program = _program(stack, word)
    program.process.send_signal(signal.SIGSTOP)
    try:
        yield
    finally:
        program.process.send_signal(signal.SIGCONT)


def _program(stack: Site, word: str) -> Program:
    return [program for program in stack.programs if program.words[0] == word][-1]


def _style(place: Locator, name: str, pseudo: str) -> str:
    script = "(element, [name, pseudo]) => getComputedStyle(element, pseudo)[name]"
    return str(place.evaluate(script, [name, pseudo]))


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
