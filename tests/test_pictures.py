"""The documentation's pictures can be taken, and show something."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sonarlog.viz.native import NoViewer
from tests import pictures

DOCS = Path(__file__).parents[1] / "docs" / "pictures"


@pytest.mark.slow
def test_all_pictures_can_be_taken(tmp_path: Path) -> None:
    try:
        taken = pictures.take(tmp_path)
    except NoViewer as error:
        pytest.skip(f"no viewer here: {error}")
    assert {"viewer-overview.png", "viewer-blocks.png", "viewer-difference.png"} <= {path.name for path in taken}
    for path in taken:
        image = np.asarray(Image.open(path).convert("L"))
        assert len(np.unique(image)) > 20, path.name
        assert (DOCS / path.name).exists()


@pytest.mark.parametrize("path", sorted(DOCS.glob("*.png")), ids=lambda path: path.name)
def test_a_kept_picture_is_small(path: Path) -> None:
    assert path.stat().st_size < 400_000
