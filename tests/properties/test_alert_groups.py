"""Grouping under any life of a condition: nothing grave is ever hidden by it."""

from dataclasses import dataclass, field

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.alerts import AlertBook, BookedAlert
from iveg.domain.events import Condition, Priority
from tests.builders import at

priorities = st.sampled_from(["P1", "P2", "P3"])
wrongs = st.one_of(st.none(), priorities)
"""What is wrong at one moment; None where nothing is."""
lives = st.lists(st.tuples(wrongs, st.booleans()), min_size=1, max_size=80)
"""Each moment: what is wrong, and whether somebody acknowledges after it."""


@dataclass
class Person:
    """Somebody who looks at the list after every moment, and hears."""

    book: AlertBook = field(default_factory=AlertBook)
    unseen: set[Priority] = field(default_factory=set)
    now: float = 0.0

    def live(self, wrong: Priority | None) -> list[BookedAlert]:
        """One second passes; returns what was raised or cleared."""
        self.now += 1.0
        conditions = [] if wrong is None else [Condition(wrong, "alert.x", "AGI")]
        changed = self.book.sync(conditions, at(self.now), f"{self.now}")
        self.unseen |= {one.last.priority for one in changed if one.cleared is None}
        return changed

    def acknowledge(self) -> None:
        for one in self.book.waiting:
            self.book.acknowledge(one.alert_id, "ana", "", at(self.now))
            self.unseen.clear()


@given(lives)
def test_a_group_is_never_shown_below_the_gravest_that_nobody_saw(
    life: list[tuple[Priority | None, bool]],
) -> None:
    person = Person()
    for wrong, sees in life:
        person.live(wrong)
        for alert in person.book.waiting:
            assert alert.priority == min({alert.condition.priority} | person.unseen)
            assert (alert.unseen is None) == (not person.unseen)
            assert (alert.last.acknowledged is None) >= (alert.unseen is not None)
        for _ in range(sees):
            person.acknowledge()


@given(lives)
def test_every_escalation_is_raised_anew_and_needs_to_be_seen(
    life: list[tuple[Priority | None, bool]],
) -> None:
    person, before = Person(), "P9"
    for wrong, sees in life:
        raised = [one for one in person.live(wrong) if one.cleared is None]
        assert bool(raised) == ((wrong or "P9") < before)
        assert all(one.last.acknowledged is None for one in raised)
        before = wrong or "P9"
        for _ in range(sees):
            person.acknowledge()


@given(lives)
def test_every_occurrence_is_counted(
    life: list[tuple[Priority | None, bool]],
) -> None:
    person, raised = Person(), 0
    for wrong, _ in life:
        raised += sum(one.cleared is None for one in person.live(wrong))
        for alert in person.book.waiting:
            assert alert.count == raised
            assert alert.raised.mono <= alert.last.raised.mono
