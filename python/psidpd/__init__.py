"""Many-body dissipative particle dynamics (DPD) from excess free energies.

    import psidpd

    model = psidpd.Model.from_file("warren2003-set6.toml")
    model.pressure([5.0, 6.0, 7.0], kT=1.0)                  # mean field
    model.phase_diagram(kT=[0.8, 1.0])                       # mean field, a DataFrame

    engine = psidpd.Engine(model, kT=1.0)
    engine.evaluate(x, box=10.0).forces                      # numpy in, numpy out

    result = psidpd.run("scene.toml", out="slab")
    result.value("surface_tension.stress")                   # value, error

    simulation = psidpd.Simulation("scene.toml")             # no files: stepped from here
    simulation.run(100)
    simulation.positions

    water = psidpd.Liquid.from_coolprop("Water", T=350)      # numbers of a data sheet
    water.model("water.toml", molecules=2)                   # a model that has them
    psidpd.mixture("water.toml", "oil.toml", "both.toml", tension=0.05)
    psidpd.wall("water.toml", "wall.toml", contact_angle=110)

All numbers are in the reduced units of the model: lengths in r_c, masses in m, energies in the unit of kT. `psidpd.ase`
has a calculator for ASE, `psidpd.lammps` finds the pair styles for LAMMPS.
"""

from ._psidpd import Engine, Evaluation, Model, estimate, version
from .errors import InputError, PsidpdError, RunStoppedError
from .liquid import Liquid, mixture, wall
from .result import Result, run, sweep
from .simulation import Simulation

__version__ = version()

__all__ = [
    "Engine",
    "Evaluation",
    "InputError",
    "Liquid",
    "Model",
    "PsidpdError",
    "Result",
    "RunStoppedError",
    "Simulation",
    "estimate",
    "mixture",
    "run",
    "sweep",
    "wall",
]
