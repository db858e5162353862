"""What the folder of a run holds, which may come from anywhere: no link in it is followed, and only regular files are read."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from .errors import InputError


def read(path: Path) -> str | None:
    """The text of a file in the folder of a run; None if it is not there."""
    refused = InputError(f"{path}: not a regular file")
    try:
        # Opening a device may act on it, and a pipe would wait.
        if not stat.S_ISREG(path.lstat().st_mode):
            raise refused
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except FileNotFoundError:
        return None
    with open(handle, encoding="utf-8") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise refused
        return file.read()
