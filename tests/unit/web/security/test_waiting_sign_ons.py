"""Sign-ins that wait for an answer of the identity provider."""

from iveg.adapters.identity_provider import Attempt
from iveg.web.security.waiting_sign_ons import WaitingSignOn, WaitingSignOns
from tests.builders import START


def test_an_answer_from_another_browser_leaves_the_sign_in_to_its_own() -> None:
    one = WaitingSignOn(Attempt("https://iveg/back"), "own", "::1", "/", START, None)
    waiting = WaitingSignOns()
    waiting.put(one)
    state = one.attempt.state

    foreign = [waiting.pop(state, browser, START) for browser in ("other", "")]
    own = [waiting.pop(state, "own", START) for _ in range(2)]

    assert (foreign, own) == ([None, None], [one, None])
