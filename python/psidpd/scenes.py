"""Scenes as files, texts and dictionaries."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .errors import InputError

AnyPath = str | os.PathLike[str]
AnyScene = AnyPath | Mapping[str, Any]


def opened(scene: AnyScene, base: AnyPath | None) -> tuple[str | None, str | None, Path]:
    """The path of a scene, or its text and the folder from which its paths start."""
    folder = Path(base or ".")
    if isinstance(scene, Mapping):
        return None, "".join(f"{_key(key)} = {toml(value)}\n" for key, value in scene.items()), folder
    if isinstance(scene, str) and "\n" in scene:
        return None, scene, folder
    return os.fspath(scene), None, folder


def toml(value: Any) -> str:
    """A value in the notation of TOML: numbers, texts, paths, lists and dictionaries, of Python or numpy."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, (str, os.PathLike)):
        return json.dumps(os.fspath(value), ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)} = {toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(toml, value)) + "]"
    raise InputError(f"a scene has numbers, texts, lists and dictionaries, not {type(value).__name__}: {value!r}")


def _key(key: Any) -> str:
    return json.dumps(str(key), ensure_ascii=False)
