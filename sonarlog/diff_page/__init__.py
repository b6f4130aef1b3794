"""The page of a difference: one HTML file that shows both maps, the walls and the numbers, and needs no network."""

from sonarlog.diff_page.drawing import draw_difference
from sonarlog.diff_page.page import CannotWritePage, check_free, page, write_page

__all__ = ["CannotWritePage", "check_free", "draw_difference", "page", "write_page"]
