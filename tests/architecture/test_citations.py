"""Every citation names a page and a section of the repository, or the paper."""

import re
from collections.abc import Iterator
from pathlib import Path

from tests.architecture import documents
from tests.processes import ROOT

_WRITTEN = {".py", ".js", ".css", ".html", ".toml", ".yaml", ".md", ".mjs", ".conf"}
_FOLDERS = ("iveg", "tests", "benchmarks", "migrations", "deploy", "docs", ".ci")
_FOREIGN = ("iveg/static/vendor/", "deploy/secrets/", "deploy/state/")
_PAGE = re.compile(r'(?<!["\w./-])([\w./-]+\.md)(?:,\s+"([^"]+)")?')
_OTHER_SOURCES = re.compile(r"MQTT 3\.1\.1 §[\d.]+")
_PAPER_ALGORITHMS = {"1", "2", "3"}


def _texts() -> Iterator[tuple[str, str]]:
    """All that people wrote but this file, by its path."""
    own = [path for folder in _FOLDERS for path in (ROOT / folder).rglob("*")]
    for path in sorted([*own, *ROOT.glob("*")]):
        name = str(path.relative_to(ROOT))
        is_written = path.suffix in _WRITTEN or name in ("Makefile", "Dockerfile")
        if is_written and not name.startswith(_FOREIGN) and path != Path(__file__):
            yield name, path.read_text()


TEXTS = dict(_texts())
PAGES = documents.pages()


def _page(name: str, citing: Path) -> Path | None:
    """The page that a citation means: from the root, or from where it stands."""
    places = (ROOT / name, citing.parent / name)
    return next((place for place in places if place.is_file()), None)


def _citations(text: str) -> Iterator[tuple[str, str]]:
    # A line break of a comment may stand within a citation, a link round its page.
    text = re.sub(r"\n\s*(?:#|\*|//)? *", " ", text)
    text = re.sub(r"\[[^\]]*\]\(([^)\s#]+)[^)]*\)", r"\1", text)
    return ((found[1], found[2] or "") for found in _PAGE.finditer(text))


def _lost(name: str, text: str) -> Iterator[str]:
    for cited, title in _citations(text):
        page = _page(cited, ROOT / name)
        if page is None:
            yield f"{name}: {cited}"
        elif title and title not in documents.headings(page.read_text()):
            yield f'{name}: {cited}, "{title}"'


def _anchors(page: Path) -> set[str]:
    titles = documents.headings(page.read_text())
    return {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}


def _broken(page: Path) -> Iterator[str]:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if "://" in target:
            continue
        name, _, anchor = target.partition("#")
        place = (page.parent / name).resolve() if name else page
        if not place.exists() or (anchor and anchor not in _anchors(place)):
            yield target


def test_every_page_that_is_cited_exists_with_its_section() -> None:
    assert [lost for text in TEXTS.items() for lost in _lost(*text)] == []


def test_every_link_leads_to_a_file_and_a_title() -> None:
    assert {page.name: [*_broken(page)] for page in PAGES if [*_broken(page)]} == {}


def test_sections_by_number_are_of_other_sources() -> None:
    assert [n for n, text in TEXTS.items() if "§" in _OTHER_SOURCES.sub("", text)] == []


def test_the_paper_is_cited_by_algorithms_that_it_has() -> None:
    cited = {
        number
        for text in TEXTS.values()
        for number in re.findall(r"Algorithms? (\d+)", text)
    }

    assert cited == _PAPER_ALGORITHMS


def test_every_invariant_that_a_test_names_is_on_the_page() -> None:
    safety = documents.section((documents.DOCS / "safety.md").read_text(), "Invariants")
    rows = set(re.findall(r"^\| ([RIL]\d+) \|", safety, re.M))
    named = {
        found.upper()
        for name, text in TEXTS.items()
        if name.startswith("tests/")
        for found in re.findall(r"\bdef test_([RIL]\d+|[ril]\d+)_", text)
    }

    assert named <= rows
    assert len(rows) == 24
