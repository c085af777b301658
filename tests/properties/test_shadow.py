"""A trial acts on nothing, whatever is tried and whatever happens."""

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.parameters import ByClass
from iveg.domain.rule.trial import Trial
from iveg.ngsi import codec
from tests.builders import detection
from tests.unit.vital.desk import Desk

_CANDIDATE = st.builds(
    DetectionRule,
    threshold=st.builds(ByClass, st.sampled_from((0.0, 0.5, 0.8, 0.95, 1.0))),
    radius_m=st.builds(ByClass, st.sampled_from((0.5, 2.0, 6.0))),
    foresight=st.booleans(),
    foresight_s=st.sampled_from((0.5, 3.0)),
)
_SEEN = st.tuples(
    st.sampled_from((1.5, 2.2, 3.0, 9.0)), st.sampled_from((0.3, 0.6, 0.79, 0.85, 1.0))
)
_STEP = st.tuples(
    st.sampled_from((0.05, 0.1, 0.4, 1.2)),
    st.sampled_from((-0.5, 0.0, 1.0)),
    st.none() | st.lists(_SEEN, max_size=3),
    st.sampled_from(("", "begin", "end")),
)


@given(_CANDIDATE, st.lists(_STEP, min_size=1, max_size=10))
def test_what_robots_and_history_are_told_is_byte_for_byte_the_same(
    candidate: DetectionRule,
    run: list[tuple[float, float, list[tuple[float, float]] | None, str]],
) -> None:
    plain, tried = Desk(), Desk()
    for after_s, speed, seen, happens in run:
        _happen(tried, candidate, happens)
        for desk in (plain, tried):
            desk.clock.now = round(desk.clock.now + after_s, 6)
            desk.drive("AGI", 0.3 * desk.clock.now, linear=speed)
            desk.drive("AGII", 8.0, linear=-speed)
            if seen is not None:
                found = [detection("farmer", x, probability=p) for x, p in seen]
                desk.look("AGII", *found)
            desk.loop.step([], desk.clock())

    assert _told(plain) == _told(tried)
    assert plain.sink.records == tried.sink.records
    assert plain.ids() == tried.ids()


def _told(desk: Desk) -> list[bytes]:
    return [codec.write_feedback(one) for one in desk.fleet.told]


def _happen(desk: Desk, candidate: DetectionRule, happens: str) -> None:
    trials, now = desk.parts.trials, desk.clock()
    if happens == "begin":
        trials.start(Trial(candidate, "ana", now.wall), now)
    elif happens == "end" and trials.current is not None:
        trials.end()
