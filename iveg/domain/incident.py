"""The manifest of an incident pack: what is in it, so that one changed byte shows.

Each file's digest goes into the next link, and the last link is the pack's own name::

    chain₀ = ""     chainₙ = SHA-256(chainₙ₋₁ ⏎ name ⏎ size ⏎ SHA-256 of the file)
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256


@dataclass(frozen=True, slots=True)
class PackedFile:
    """One file of a pack.

    Attributes:
        size: Bytes; ``digest`` the SHA-256 of them.
        chain: Of all files up to this one.
    """

    name: str
    size: int
    digest: str
    chain: str


@dataclass(frozen=True, slots=True)
class FoundFile:
    """A file as it is found (bytes; SHA-256)."""

    size: int
    digest: str


def chained(files: Iterable[tuple[str, FoundFile]]) -> Sequence[PackedFile]:
    """The manifest of files in their order."""
    chain, packed = "", []
    for name, found in files:
        link = f"{chain}\n{name}\n{found.size}\n{found.digest}"
        chain = sha256(link.encode()).hexdigest()
        packed.append(PackedFile(name, found.size, found.digest, chain))
    return packed


def faults(
    manifest: Sequence[PackedFile], found: Mapping[str, FoundFile]
) -> Iterator[str]:
    """What is wrong with a pack, one sentence each."""
    named = [one.name for one in manifest]
    for name in sorted(set(found) - set(named)):
        yield f"{name} is not in the manifest."
    for one in manifest:
        if one.name not in found:
            yield f"{one.name} is missing."
        elif found[one.name] != FoundFile(one.size, one.digest):
            yield f"{one.name} was changed."
    as_told = ((one.name, FoundFile(one.size, one.digest)) for one in manifest)
    if list(chained(as_told)) != list(manifest):
        yield "The manifest itself was changed: its chain does not hold."
