"""Runs package.py with stand-ins for Spack, which no registry of the checks has, and compares it with Cargo.toml.

A name that Spack does not have, a directive without what it needs, or another version, licence or compiler fails.
"""

import sys
import tomllib
from pathlib import Path
from types import ModuleType, SimpleNamespace

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
NEEDS = {"license": set(), "version": set(), "variant": {"default", "description"}, "depends_on": {"type"}}
said = {name: {} for name in NEEDS}


def directive(name):
    def say(first, **more):
        assert NEEDS[name] <= set(more), f"{name}({first!r}) lacks {NEEDS[name] - set(more)}"
        said[name][first] = more

    return say


class CargoPackage:
    """What Spack builds with cargo."""


cargo = "spack_repo.builtin.build_systems.cargo"
for name in ["spack", "spack.package", *(cargo.rsplit(".", k)[0] for k in range(4))]:
    sys.modules[name] = ModuleType(name)
sys.modules[cargo].CargoPackage = CargoPackage
for name in NEEDS:
    setattr(sys.modules["spack.package"], name, directive(name))

names = {}
exec(compile((HERE / "package.py").read_text(), "package.py", "exec"), names)
recipe = names["Psidpd"]
package = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]
assert issubclass(recipe, CargoPackage) and recipe.__doc__
assert recipe.homepage == package["repository"] and recipe.git == package["repository"] + ".git"
assert list(said["license"]) == [package["license"]], said["license"]
assert said["version"][package["version"]] == {"tag": "v" + package["version"]}, said["version"]
assert said["version"]["main"] == {"branch": "main"}, said["version"]
assert set(said["depends_on"]) == {"c", f"rust@{package['rust-version']}:"}, said["depends_on"]
program = tomllib.loads((ROOT / recipe.build_directory / "Cargo.toml").read_text())
assert set(said["variant"]) < set(program["features"]), said["variant"]
for chosen in said["variant"]:
    built = recipe()
    built.spec = SimpleNamespace(satisfies=lambda wish, chosen=chosen: wish == "+" + chosen)
    assert built.build_args == ["--locked", "--features", chosen]
    built.spec = SimpleNamespace(satisfies=lambda wish: False)
    assert built.build_args == ["--locked"]
print("spack:", program["package"]["name"], package["version"])
