import pytest

from iveg.adapters.toml_files import KeyPath, place_of

TEXT = """\
title = "x"
  inner.depth = 1

[[robots]]
id = "A"
body = { length = 1, "wide" = 2 }

[robots.drive]
'type' = "x"

[[robots]]
id = "B"
[robots.drive]
speed = 3

[house]
rows = [
  # the first
  { xmin = 1, ymin = 2 },
  { xmin = 3 },
]
name = "y"
"""


@pytest.mark.parametrize(
    ("path", "place"),
    [
        (("title",), (1, 1)),
        (("inner", "depth"), (2, 3)),
        (("robots", 0), (4, 1)),
        (("robots", 0, "id"), (5, 1)),
        (("robots", 0, "body", "length"), (6, 10)),
        (("robots", 0, "body", "wide"), (6, 22)),
        (("robots", 0, "drive"), (8, 1)),
        (("robots", 0, "drive", "type"), (9, 1)),
        (("robots", 1, "id"), (12, 1)),
        (("robots", 1, "drive", "speed"), (14, 1)),
        (("house", "rows", 0, "ymin"), (19, 15)),
        (("house", "rows", 1), (20, 3)),
        (("house", "rows", 1, "xmax"), (20, 3)),
        (("house", "name"), (22, 1)),
    ],
)
def test_a_key_is_found_by_line_and_column(
    path: KeyPath, place: tuple[int, int]
) -> None:
    assert place_of(TEXT, path) == place


@pytest.mark.parametrize(
    ("path", "place"),
    [
        (("robots", 1, "body", "length"), (11, 1)),
        (("robots", 0, "drive", "speed"), (8, 1)),
        (("robots", 7), (1, 1)),
        ((), (1, 1)),
    ],
)
def test_what_is_missing_is_looked_for_where_it_belongs(
    path: KeyPath, place: tuple[int, int]
) -> None:
    assert place_of(TEXT, path) == place
