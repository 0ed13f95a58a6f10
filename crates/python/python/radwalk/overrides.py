"""Keyword arguments as overrides of a job: ``paths=1e6`` is ``--set budget.paths=1000000``."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from numbers import Integral, Real

import numpy as np

SHORT = {
    "first_path": "budget.first_path",
    "paths": "budget.paths",
    "wall_seconds": "budget.wall_seconds",
}

BARE = re.compile(r"[A-Za-z0-9_-]+\Z")


def overrides(keys):
    """``key=value`` for each key, whose parts are joined by dots; tables become a key for each of their own."""
    typed = []
    for key, value in keys.items():
        if key == "target" and isinstance(value, Real):
            key = "target.relative_error"
        typed.extend(flat(SHORT.get(key, key), value))
    return typed


def flat(key, value):
    """Overrides of a key; of its keys, where it is a table whose keys can be told apart by dots."""
    if isinstance(value, Mapping) and value and all(BARE.match(str(inner)) for inner in value):
        for inner, of_inner in value.items():
            yield from flat(f"{key}.{inner}", of_inner)
    else:
        yield f"{key}={toml(value)}"


def toml(value):
    """A value as TOML. Whole floats become integers, so that 1e6 can count."""
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Integral):
        return str(int(value))
    if isinstance(value, Real):
        value = float(value)
        return str(int(value)) if value.is_integer() else repr(value)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{string(inner)} = {toml(of_inner)}" for inner, of_inner in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(toml, value)) + "]"
    return string(value)


def string(value):
    """A TOML string, whose escapes are those of JSON."""
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")
