"""What the lines and patterns of a picture mean, in rows below it. Must not know: maps."""

from collections.abc import Sequence
from dataclasses import dataclass

from PIL import Image, ImageDraw, ImageFont

from sonarlog.changes import Change, swatch

ROW_PX, SAMPLE_PX, AFTER_PX, SIZE = 28, 32, 28, 16
INK = (30, 30, 30)


@dataclass(frozen=True)
class Sign:
    """A line of a colour, drawn `line`, `dashes` or `dots`, or the pattern of a change; and what it means."""

    text: str
    colour: tuple[int, int, int]
    stroke: str = "line"
    change: Change | None = None

    @property
    def width(self) -> int:
        """Pixels, with the gap to the next."""
        return SAMPLE_PX + round(ImageFont.load_default(size=SIZE).getlength(self.text)) + AFTER_PX


def in_rows(signs: Sequence[Sign], width: int) -> list[list[Sign]]:
    """The signs in as few rows as fit into `width` pixels, in their order."""
    rows: list[list[Sign]] = [[]]
    for sign in signs:
        if rows[-1] and sum(each.width for each in rows[-1]) + sign.width - AFTER_PX > width:
            rows.append([])
        rows[-1].append(sign)
    return rows


def draw_legend(sheet: Image.Image, rows: Sequence[Sequence[Sign]], left: int, top: int) -> None:
    """Draw the rows onto the sheet."""
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=SIZE)
    for number, row in enumerate(rows):
        x, y = left, top + number * ROW_PX + ROW_PX // 2 - 4
        for sign in row:
            _sample(sheet, pen, sign, x, y)
            pen.text((x + SAMPLE_PX, y), sign.text, fill=INK, font=font, anchor="lm")
            x += sign.width


def _sample(sheet: Image.Image, pen: ImageDraw.ImageDraw, sign: Sign, x: int, y: int) -> None:
    if sign.change is not None:
        sheet.paste(Image.fromarray(swatch(sign.change, 24, 16)), (x, y - 8))
    elif sign.stroke == "dots":
        for k in range(4):
            pen.ellipse((x + 7 * k, y - 2, x + 7 * k + 3, y + 1), fill=sign.colour)
    else:
        for k in (0, 14) if sign.stroke == "dashes" else (0,):
            pen.line([(x + k, y), (x + k + 9 if sign.stroke == "dashes" else x + 24, y)], fill=sign.colour, width=3)
