# Spack: copy this file to packages/psidpd of a repository of packages.
# SPDX-License-Identifier: GPL-2.0-or-later

from spack_repo.builtin.build_systems.cargo import CargoPackage

from spack.package import *


class Psidpd(CargoPackage):
    """Many-body dissipative particle dynamics from excess free energies: the program psidpd."""

    homepage = "https://github.com/psidpd/psidpd"
    git = "https://github.com/psidpd/psidpd.git"

    license("GPL-2.0-or-later")

    version("main", branch="main")
    version("0.2.0", tag="v0.2.0")

    depends_on("c", type="build")
    depends_on("rust@1.95:", type="build")

    build_directory = "validation"

    @property
    def build_args(self):
        return ["--locked"]
