"""How far two runs may be apart and still count as the same, said in so many words. Must not know: runs, reports."""

import re
from dataclasses import dataclass

from sonarlog.errors import SonarlogError

UNITS = {"mm": ("mm", 1.0), "cm": ("mm", 10.0), "m": ("mm", 1000.0), "deg": ("deg", 1.0), "°": ("deg", 1.0),
         "cells": ("cells", 1.0), "cell": ("cells", 1.0)}  # fmt: skip
_PART = re.compile(r"\s*([0-9]*\.?[0-9]+)\s*([a-z°]+)\s*")


class BadTolerance(SonarlogError):
    """No tolerance is said so."""

    def __init__(self, text: str) -> None:
        super().__init__(f"a tolerance is written 5mm,0.1deg,20cells (any of the three), not {text!r}")


@dataclass(frozen=True)
class Tolerance:
    """Poses and walls within so many mm and degrees, and so many cells of the map that may differ."""

    mm: float = 0.0
    deg: float = 0.0
    cells: int = 0

    @classmethod
    def parse(cls, text: str) -> "Tolerance":
        """Of `5mm,0.1deg,20cells`. Raises BadTolerance."""
        values = {"mm": 0.0, "deg": 0.0, "cells": 0.0}
        for part in text.split(","):
            found = _PART.fullmatch(part)
            if found is None or found[2] not in UNITS:
                raise BadTolerance(text)
            name, factor = UNITS[found[2]]
            values[name] = factor * float(found[1])
        return cls(values["mm"], values["deg"], int(values["cells"]))

    @property
    def words(self) -> str:
        """`5 mm, 0.1° and 20 cells`."""
        return f"{self.mm:g} mm, {self.deg:g}° and {self.cells} cells"
