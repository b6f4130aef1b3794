"""Dataclasses from the plain terms of `read_canonical`, by their type hints: canonical bytes, read back whole.

Must not know: which dataclasses there are.
"""

from collections.abc import Mapping
from dataclasses import is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np


def restored(kind: Any, plain: Any) -> Any:
    """The value of that type. Raises TypeError and KeyError for terms that are not of it."""
    origin, inner = get_origin(kind), get_args(kind)
    if is_dataclass(kind):
        hints: dict[str, Any] = _hints(kind)  # type: ignore[arg-type]  # a class is hashable
        return kind(**{name: restored(hint, plain[name]) for name, hint in hints.items()})  # type: ignore[operator]
    if origin is UnionType:
        return None if plain is None else restored(next(each for each in inner if each is not NoneType), plain)
    if origin is tuple and len(inner) == 2 and inner[1] is Ellipsis:
        return tuple(restored(inner[0], item) for item in plain)
    if origin is tuple:
        return tuple(restored(each, item) for each, item in zip(inner, plain, strict=True))
    if origin is Mapping:
        return {restored(inner[0], key): restored(inner[1], item) for key, item in plain.items()}
    expected = np.ndarray if origin is np.ndarray else kind
    if isinstance(expected, type) and not isinstance(plain, expected):
        raise TypeError(f"{plain!r} is no {expected.__name__}")
    return plain


@cache
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind)
