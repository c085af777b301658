"""Functions of a JavaScript file, found by their braces; no parser, no Node.js."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

_TEXT = re.compile(
    r"""//[^\n]*|/\*.*?\*/              # comments
    |"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'
    |(?<=[(,=:\[!&|?{};\n])[ ]*/(?![/*])(?:\\.|\[(?:\\.|[^\]\\\n])*\]|[^/\\\n\[])+/
    """,
    re.DOTALL | re.VERBOSE,
)
_LONGEST_HEAD = 1500
"""Before a brace: a function's name and parameters (characters)."""
_NOT_FUNCTIONS = frozenset({"if", "for", "while", "switch", "catch", "with"})
_NAME = re.compile(r"([\w$#]+)\s*$")
_ARROW_OF = re.compile(r"([\w$]+)\s*[:=]\s*(?:async\s*)?(?:\([^()]*\)|[\w$]+)\s*=>\s*$")


@dataclass(frozen=True, slots=True)
class Function:
    """One function with a body in braces.

    Attributes:
        own: Lines that are not those of functions inside it.
        whole: All lines.
    """

    name: str
    own: int
    whole: int


def functions(text: str) -> Iterator[Function]:
    """Every function, the inner before the outer."""
    code = _TEXT.sub(_blank, _without_templates(text))
    open_at: list[tuple[str | None, int]] = []
    inside = [0]
    for place in re.finditer(r"[{}]", code):
        if place[0] == "{":
            since = max(0, place.start() - _LONGEST_HEAD)
            name, start = _head(code[since : place.start()])
            open_at.append((name, since + start))
            inside.append(0)
            continue
        name, start = open_at.pop()
        within = inside.pop()
        if name is not None:
            whole = code.count("\n", start, place.end()) + 1
            yield Function(name, whole - within, whole)
            within = whole
        inside[-1] += within


def _blank(found: re.Match[str]) -> str:
    return re.sub(r"[^\n]", " ", found[0])


def _without_templates(text: str) -> str:
    """The same text; what stands in back ticks is empty, line by line."""
    ticks = [one.start() for one in re.finditer(r"(?<!\\)`", _TEXT.sub(_blank, text))]
    pieces, at = [], 0
    for (start, end), is_inside in zip(
        pairwise(ticks), _alternating(len(ticks)), strict=False
    ):
        if is_inside:
            pieces += [text[at:start], re.sub(r"[^\n]", " ", text[start : end + 1])]
            at = end + 1
    return "".join([*pieces, text[at:]])


def _alternating(count: int) -> Iterator[bool]:
    return (number % 2 == 0 for number in range(count))


def _head(before: str) -> tuple[str | None, int]:
    """The name of the function that a brace opens, None where it opens none."""
    head = before.rstrip()
    if head.endswith("=>"):
        named = _ARROW_OF.search(head)
        return ("=>", len(head)) if named is None else (named[1], named.start())
    if not head.endswith(")"):
        return None, len(head)
    start = _matching(head)
    name = _NAME.search(head[:start])
    if name is None:
        return "function", start
    return (None if name[1] in _NOT_FUNCTIONS else name[1]), name.start()


def _matching(head: str) -> int:
    """Where the bracket opens that the text ends with closing."""
    depth = 0
    for place in range(len(head) - 1, -1, -1):
        depth += {")": 1, "(": -1}.get(head[place], 0)
        if depth == 0:
            return place
    raise AssertionError(f"brackets do not match before {head[-80:]!r}")
