import numpy
import psidpd
import pytest

ase = pytest.importorskip("ase")
from psidpd.ase import Psidpd  # noqa: E402


def test_the_calculator_has_the_numbers_of_the_engine(warren, points):
    atoms = ase.Atoms(["X"] * len(points), positions=points, cell=[4.0] * 3, pbc=True)
    atoms.calc = Psidpd(warren, kT=1.0)
    found = psidpd.Engine(warren, 1.0).evaluate(points, 4.0)
    assert atoms.get_potential_energy() == found.energy
    assert (atoms.get_forces() == found.forces).all()
    stress = atoms.get_stress(voigt=False)
    assert stress[0, 0] == pytest.approx(-found.virial[0] / 64) and stress[0, 1] == pytest.approx(-found.virial[3] / 64)


def test_stress_is_the_strain_derivative(warren, points):
    from ase.calculators.fd import calculate_numerical_stress

    atoms = ase.Atoms(["X"] * len(points), positions=points, cell=[4.0] * 3, pbc=True)
    atoms.calc = Psidpd(warren, kT=1.0)
    assert atoms.get_stress() == pytest.approx(calculate_numerical_stress(atoms, eps=1e-6), abs=1e-3)


def test_dynamics_keeps_the_energy(warren, points):
    from ase import units
    from ase.md.verlet import VelocityVerlet

    atoms = ase.Atoms(["X"] * len(points), positions=points, cell=[4.0] * 3, pbc=True)
    atoms.set_masses(numpy.ones(len(points)))
    atoms.calc = Psidpd(warren, kT=1.0)
    from ase.optimize import FIRE

    FIRE(atoms, logfile=None, maxstep=0.02).run(fmax=50, steps=60)
    before = atoms.get_total_energy()
    VelocityVerlet(atoms, timestep=0.002 * units.fs / units.fs).run(100)
    assert abs(atoms.get_total_energy() - before) < 0.05 * len(points)


def test_symbols_stand_for_species(huggins, points):
    symbols = ["Ar" if k % 2 else "Kr" for k in range(len(points))]
    atoms = ase.Atoms(symbols, positions=points, cell=[4.0] * 3, pbc=True)
    atoms.calc = Psidpd(huggins, kT=1.0, species={"Kr": "A", "Ar": "B"})
    kinds = numpy.arange(len(points)) % 2
    assert atoms.get_potential_energy() == psidpd.Engine(huggins, 1.0).evaluate(points, 4.0, kinds).energy
    atoms.calc = Psidpd(huggins, kT=1.0)
    with pytest.raises(psidpd.InputError, match="symbol Kr"):
        atoms.get_potential_energy()
