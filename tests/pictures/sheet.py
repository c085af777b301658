"""All pictures as thumbnails on one sheet, with what each is of below it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from tests.pictures.pairs import Case

CELL = (300, 260)
TEXT_PX = 42
COLUMNS = 8


@dataclass(frozen=True, slots=True)
class Picture:
    """One that was taken.

    Attributes:
        high: Of the whole page (px), of which the picture shows a window.
        found: What a script found wrong with it.
    """

    number: int
    case: Case
    file: Path
    high: int
    found: tuple[str, ...] = ()

    @property
    def said(self) -> str:
        """One line."""
        wrong = f" ! {'; '.join(self.found)}" if self.found else ""
        return f"{self.number:03} {' '.join(self.case.values())} {self.high} px{wrong}"


def sheet_of(pictures: Sequence[Picture]) -> Image.Image:
    """The sheet."""
    rows = -(-len(pictures) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * CELL[0], rows * CELL[1]), "white")
    for n, picture in enumerate(pictures):
        row, column = divmod(n, COLUMNS)
        _draw(sheet, picture, column * CELL[0], row * CELL[1])
    return sheet


def _draw(sheet: Image.Image, picture: Picture, x: int, y: int) -> None:
    with Image.open(picture.file) as whole:
        small = whole.convert("RGB")
    small.thumbnail((CELL[0] - 8, CELL[1] - TEXT_PX - 4))
    sheet.paste(small, (x, y + TEXT_PX))
    ink = "#c00000" if picture.found else "#000000"
    words = picture.said.split(" ! ")[0].split()
    lines = " ".join(words[:3]), " ".join(words[3:])
    font = ImageFont.load_default(14)
    ImageDraw.Draw(sheet).multiline_text((x, y), "\n".join(lines), ink, font)
