"""The witness of the chaos tests sees what it is there to see."""

from itertools import count

from iveg.domain.observations import Hold
from iveg.ngsi import codec
from tests.builders import odometry, origin, safety_report
from tests.chaos.witness import Witness

TICKS = count(1)
"""Each message was measured a tenth of a second after the one before."""


def later() -> float:
    return next(TICKS) / 10


def tell(witness: Witness, *speeds: float) -> None:
    for speed in speeds:
        moving = odometry("AGI", linear=speed, origin=origin(after=later()))
        witness.take("/iveg/AGI_odom/attrs", codec.write_measure(moving))


def hold(witness: Witness, seq: int = 1, after: float | None = None) -> None:
    held = Hold("01A", "iveg", "remote")
    report = safety_report("AGI", held, origin=origin(seq, after=after or later()))
    witness.take("/iveg/AGI_safety/attrs", codec.write_measure(report))


def free(witness: Witness, seq: int) -> None:
    report = safety_report("AGI", origin=origin(seq))
    witness.take("/AGI/iveg/safety", codec.write_measure(report))


def test_a_motion_that_nobody_allowed_is_counted_once() -> None:
    witness = Witness(0)
    hold(witness)

    tell(witness, 0.0, 0.3, 0.5, 0.5)

    assert (witness.starts, witness.unlicensed) == (1, 1)


def test_a_resume_allows_motions_until_the_robot_is_held_again() -> None:
    witness = Witness(0)
    hold(witness)
    free(witness, 2)
    witness.allow("AGI")
    tell(witness, 0.0, 0.3, 0.0, 0.3, 0.0)
    hold(witness, 3)

    tell(witness, 0.0, 0.3)

    assert (witness.starts, witness.unlicensed) == (3, 1)


def test_what_goes_past_the_agent_is_seen_too() -> None:
    witness = Witness(0)
    report = safety_report("AGI", Hold("01A", "iveg", "remote"))
    witness.take("/AGI/iveg/safety", codec.write_measure(report))
    witness.take("/AGI/iveg/odom", codec.write_measure(odometry("AGI", linear=0.3)))

    assert witness.of("AGI").held
    assert witness.unlicensed == 1


def test_a_robot_that_still_brakes_keeps_its_allowance() -> None:
    witness = Witness(0)
    witness.allow("AGI")
    tell(witness, 0.4)

    hold(witness)

    assert witness.of("AGI").allowed


def test_a_robot_that_comes_to_rest_while_it_is_held_may_not_start_again() -> None:
    witness = Witness(0)
    witness.allow("AGI")
    tell(witness, 0.4)
    hold(witness)

    tell(witness, 0.0, 0.3)

    assert (witness.starts, witness.unlicensed) == (2, 1)


def test_a_report_that_overtook_the_odometry_of_a_start_forbids_nothing() -> None:
    witness = Witness(0)
    witness.allow("AGI")
    tell(witness, 0.0)
    hold(witness, after=later() + 10.0)

    tell(witness, 0.3)

    assert (witness.starts, witness.unlicensed) == (1, 0)


def test_a_report_that_comes_again_takes_nothing_back() -> None:
    witness = Witness(0)
    hold(witness, 1)
    free(witness, 2)
    witness.allow("AGI")

    hold(witness, 1)
    tell(witness, 0.3)

    assert witness.of("AGI").words == 2
    assert witness.unlicensed == 0
