"""Moments of robots from rows of the truth (``emulator.truth.true_picture``).

A person is in view where the newest picture of some robot has them, if it is not older
than a quarter of a second: robots take theirs at different times.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from math import dist
from operator import itemgetter
from typing import Final

from iveg.lab.experiment.protection import NearMoment, NearPerson, Sight
from iveg.lab.experiment.recording import Row

_STILL_S: Final = 0.25
"""How long a picture, or a gap between two, counts (s)."""
_SAME_M: Final = 1.0
"""Who is farther from where iVeg has somebody is somebody else (m)."""


def moments_of(
    truth: Iterable[Row], encounters: Sequence[Row] = ()
) -> Iterator[NearMoment]:
    """Every robot at each of its pictures, in the order of time.

    Args:
        truth: Rows of the truth.
        encounters: With people, as iVeg told them: ``robot``, ``at``, ``people``
            (each the place ``x``, ``y`` where iVeg has somebody), at the same times.
    """
    people_at = {(one["robot"], one["at"]): one["people"] for one in encounters}
    newest: dict[str, Row] = {}
    for at, same in groupby(sorted(truth, key=itemgetter("at")), itemgetter("at")):
        rows, before = list(same), dict(newest)
        newest.update({row["robot"]: row for row in rows})
        young = (row for row in newest.values() if at - row["at"] <= _STILL_S)
        in_view = {one["key"] for row in young for one in row["visible"]}
        for row in rows:
            places = people_at.get((row["robot"], at), ())
            last_at = before.get(row["robot"], row)["at"]
            yield NearMoment(
                row["robot"],
                at,
                min(at - last_at, _STILL_S),
                abs(row["speed"]),
                row["wanted"],
                row["factor"],
                tuple(_people(row, in_view, places)),
            )


def _people(row: Row, in_view: set[str], places: Sequence[Row]) -> Iterator[NearPerson]:
    foretold = {person_at(row["people"], one["x"], one["y"]) for one in places}
    here = row["pose"]["x"], row["pose"]["y"]
    for one in row["people"]:
        key = one["key"]
        sight: Sight = "behind_plants" if one["hidden"] else "unseen"
        if key in in_view:
            sight = "in_view"
        yield NearPerson(key, dist(here, (one["x"], one["y"])), sight, key in foretold)


def person_at(people: Iterable[Row], x: float, y: float) -> str | None:
    """Who really is at a place (m), by the truth's keys; None: nobody."""
    away = {one["key"]: dist((one["x"], one["y"]), (x, y)) for one in people}
    nearest = min(away, key=lambda key: away[key], default=None)
    return nearest if nearest is not None and away[nearest] <= _SAME_M else None
