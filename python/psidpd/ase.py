"""A calculator for the Atomic Simulation Environment (ASE)."""

import numpy
from ase.calculators.calculator import Calculator, all_changes

from . import Engine
from .errors import InputError


class Psidpd(Calculator):
    """Conservative energies, forces and stresses of a psidpd model at one temperature.

        atoms.calc = psidpd.ase.Psidpd(model, kT=1.0, species={"X": "F"})

    Numbers are in the reduced units of the model, whatever ASE calls them: lengths in r_c, energies in the unit of kT.
    `species` names the model's species for each chemical symbol; left out, symbols are the names of species themselves,
    or all particles are the only species. ASE has symbols of elements, and "X" for all others.

    There is no drag and no noise here: give an integrator of ASE its own thermostat, or use `psidpd.run`.
    """

    implemented_properties = ["energy", "free_energy", "forces", "stress"]

    def __init__(self, model, kT, *, species=None, precision="double", threads=1, **options):
        super().__init__(**options)
        self.engine = Engine(model, kT, precision=precision, threads=threads)
        self.names = list(model.species)
        self.dimensions = model.dimensions
        self.species = dict(species or {})

    def _type(self, symbol):
        name = self.species.get(symbol, symbol)
        if name in self.names:
            return self.names.index(name)
        if symbol not in self.species and len(self.names) == 1:
            return 0
        raise InputError(
            f"the symbol {symbol} is not a species of this model ({', '.join(self.names)}): give species={{{symbol!r}: …}}"
        )

    def calculate(self, atoms=None, properties=None, system_changes=all_changes):
        """Computes everything for `atoms`; called by ASE."""
        super().calculate(atoms, properties, system_changes)
        atoms = self.atoms
        cell = atoms.cell.complete() if not atoms.cell.any() or atoms.cell.rank < 3 else atoms.cell
        types = [self._type(symbol) for symbol in atoms.get_chemical_symbols()]
        found = self.engine.evaluate(
            atoms.positions, numpy.array(cell), numpy.array(types, numpy.int32), periodic=list(map(bool, atoms.pbc))
        )
        self.results = {"energy": found.energy, "free_energy": found.energy, "forces": found.forces}
        if atoms.cell.rank == 3:
            # Order of ASE: xx, yy, zz, yz, xz, xy; positive under tension.
            self.results["stress"] = -found.virial[[0, 1, 2, 5, 4, 3]] / atoms.get_volume()
