"""Models of liquids from their data sheets, of two from the tension between them, and walls from their contact angles."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .errors import InputError, RunStoppedError
from .files import read
from .scenes import AnyPath


@dataclass(frozen=True)
class Liquid:
    """What a data sheet says of a liquid, in SI units; numbers that are None are free.

        water = psidpd.Liquid.from_coolprop("Water", T=350)
        found = water.model("water.toml", molecules=2)

    density in kg/m3, tension in N/m, compressibility (isothermal) in 1/Pa, viscosity in Pa s, temperature in K, molar_mass in kg/mol.
    """

    name: str
    density: float
    tension: float | None = None
    compressibility: float | None = None
    viscosity: float | None = None
    temperature: float | None = None
    molar_mass: float | None = None

    @classmethod
    def from_coolprop(cls, fluid: str, T: float) -> Liquid:
        """The saturated liquid of a fluid of CoolProp at T kelvin: `pip install psidpd[coolprop]`.

        What CoolProp does not know of the fluid is free. Raises InputError for a fluid or a temperature without a saturated liquid.
        """
        try:
            from CoolProp.CoolProp import PropsSI
        except ImportError as missing:
            raise InputError("CoolProp is not installed: pip install psidpd[coolprop]") from missing

        def known(key: str) -> float | None:
            try:
                return float(PropsSI(key, "T", T, "Q", 0, fluid))
            except ValueError:
                return None

        density = known("D")
        if density is None:
            raise InputError(f"CoolProp has no saturated liquid of {fluid} at {T} K")
        compressibility = known("ISOTHERMAL_COMPRESSIBILITY")
        return cls(fluid, density, known("I"), compressibility, known("V"), float(T), known("M"))

    def model(
        self,
        out: AnyPath,
        *,
        molecules: float | None = None,
        rc: float | None = None,
        drop: float | None = None,
        particles: float | None = None,
        number_density: float | None = None,
        seed: int = 1,
        anyway: bool = False,
        overwrite: bool = False,
    ) -> dict[str, Any]:
        """Finds a model as `psidpd model liquid` does, writes it to `out`, and gives the table: minutes.

        One size of a particle is needed: molecules in it, rc in m, or the diameter of a drop in m with its number of particles. The
        result has "good", which says whether all numbers are met, "rows" with what was wanted and what was measured, and "refusals". If
        a number is not met `out` is written with `anyway` alone.

        Raises InputError for numbers that cannot be used.
        """
        numbers = {key: getattr(self, key) for key in self.__dataclass_fields__ if key != "name"}
        sizes = {"molecules": molecules, "rc": rc, "drop": drop, "particles": particles, "number_density": number_density}
        return found("liquid", [self.name], numbers | sizes | {"seed": seed}, out, anyway=anyway, overwrite=overwrite)


def wall(
    model: AnyPath,
    out: AnyPath,
    *,
    contact_angle: float,
    kT: float = 1.0,
    density: float | None = None,
    viscosity: float | None = None,
    seed: int = 1,
    anyway: bool = False,
    overwrite: bool = False,
) -> dict[str, Any]:
    """Finds the wall on which a liquid has a contact angle, in degrees, as `psidpd model wall` does: minutes.

    Writes the scene of a ridge on it to `out`, and gives what was found: "good", the "strength" of the wall's
    attraction, the angles "young" and "ridge" with their errors, and the tensions. If the angle is not met `out` is
    written with `anyway` alone. density is about that of the liquid, if theory does not know it; with its viscosity it does not slip.

    Raises InputError for a model or an angle that cannot be used.
    """
    numbers = {"contact_angle": contact_angle, "kT": kT, "density": density, "viscosity": viscosity, "seed": seed}
    return found("wall", [os.path.abspath(model)], numbers, out, anyway=anyway, overwrite=overwrite)


def mixture(
    model: AnyPath,
    other: AnyPath,
    out: AnyPath,
    *,
    tension: float,
    species: tuple[str, str] | None = None,
    kT: float = 1.0,
    densities: tuple[float, float] | None = None,
    seed: int = 1,
    anyway: bool = False,
    overwrite: bool = False,
) -> dict[str, Any]:
    """Joins the models of two liquids as `psidpd model mixture` does: minutes.

    The tension of their interface is in N/m if the models have units, else in theirs. Writes the model of both to `out`, with
    the names of the files or `species` for its species, and gives what was found: "good", "cross", the factor of the
    attraction between the species, "mass" of a particle of the second, and "layers" with the "tension", in units of the models ("unit" is
    theirs in N/m), and what is "dissolved". If the tension is not met `out` is written with `anyway` alone. densities are about those of
    the liquids, if theory does not know them.

    Raises InputError for models that cannot be mixed, or a tension that cannot be used.
    """
    numbers = {"tension": tension, "species": species, "kT": kT, "densities": densities, "seed": seed}
    files = [os.path.abspath(file) for file in (model, other)]
    return found("mixture", files, numbers, out, anyway=anyway, overwrite=overwrite)


Given = float | tuple[float, float] | tuple[str, str] | None


def option(key: str, value: Given) -> list[str]:
    """An option of the command line, with one value or two."""
    values = value if isinstance(value, tuple) else (value,)
    texts = [x if isinstance(x, str) else repr(x if isinstance(x, int) or x is None else float(x)) for x in values]
    name = f"--{key.replace('_', '-')}"
    # A negative number next to its option is read as a number.
    return [f"{name}={texts[0]}"] if len(texts) == 1 else [name, *texts]


def found(
    verb: str, names: list[str], numbers: Mapping[str, Given], out: AnyPath, *, anyway: bool, overwrite: bool
) -> dict[str, Any]:
    """What `psidpd model VERB` writes with --json."""
    options = [text for key, value in numbers.items() if value is not None for text in option(key, value)]
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder, "found.json")
        command = [sys.executable, "-m", "psidpd", "model", verb, *options]
        command += ["--out", os.path.abspath(out), "--json", str(table)]
        command += ["--anyway"] * anyway + ["--overwrite"] * overwrite + ["--", *names]
        # From an empty folder, as Python imports what lies in the working one.
        run = subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        text = read(table)
        if text is not None:
            result: dict[str, Any] = json.loads(text)
            return result
    raise (InputError if run.returncode == 2 else RunStoppedError)(run.stderr.strip())
