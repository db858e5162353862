"""Reads the files of a run with MDAnalysis, ASE, gsd and PyVista, and writes what they see as JSON.

read_back.py FOLDER BINS RANGE: dump.lammpstrj, trajectory.xyz, trajectory.gsd, vtk and final.data in FOLDER; pairs
of all particles are counted in BINS bins of distance up to RANGE.
"""

import glob
import json
import sys
import warnings

import ase
import ase.geometry.rdf
import ase.io
import ase.units
import gsd.hoomd
import MDAnalysis
import numpy
import pyvista
from MDAnalysis.analysis.rdf import InterRDF

# MDAnalysis warns of what files of point particles do not have: elements, bonds, residues.
warnings.simplefilter("ignore")

folder, bins, reach = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
dump, xyz, data = (f"{folder}/{name}" for name in ("dump.lammpstrj", "trajectory.xyz", "final.data"))
style = "id type x y z"


def mda(universe, velocities=True):
    frames = []
    for ts in universe.trajectory:
        box = None if ts.dimensions is None else ts.dimensions.tolist()
        atoms = universe.atoms
        frame = {"box": box, "x": atoms.positions.tolist(), "step": ts.data.get("step")}
        if velocities:
            frame["v"] = atoms.velocities.tolist()
        for name in ("ids", "types", "names", "masses"):
            if hasattr(atoms, name):
                frame[name] = getattr(atoms, name).tolist()
        frames.append(frame)
    return frames


def by_ase(atoms):
    frame = {
        "cell": atoms.cell.tolist(),
        "pbc": atoms.pbc.tolist(),
        "numbers": atoms.numbers.tolist(),
        "x": atoms.positions.tolist(),
        "info": {k: float(v) for k, v in atoms.info.items() if isinstance(v, (int, float, numpy.number))},
    }
    for name in ("id", "velo", "type"):
        if name in atoms.arrays:
            frame[name] = atoms.arrays[name].tolist()
    if atoms.has("momenta"):
        # ASE knows no reduced units: it took the numbers for those of LAMMPS's metal units, Å and Å/ps.
        frame["v"] = (atoms.get_velocities() * 1000.0 * ase.units.fs).tolist()
    return frame


def by_gsd(frame):
    particles, configuration = frame.particles, frame.configuration
    frame.validate()
    return {
        "step": int(configuration.step),
        "time": float(frame.log["time"][0]),
        "dimensions": int(configuration.dimensions),
        "box": configuration.box.tolist(),
        "types": particles.types,
        "typeid": particles.typeid.tolist(),
        "mass": particles.mass.tolist(),
        "x": particles.position.tolist(),
        "v": particles.velocity.tolist(),
    }


def by_pyvista(path):
    data = pyvista.read(path)
    seen = {
        "step": int(data.field_data["Step"][0]),
        "time": float(data.field_data["TimeValue"][0]),
        "names": list(data.field_data["SpeciesNames"]),
        "arrays": {name: data.point_data[name].tolist() for name in data.point_data},
    }
    if isinstance(data, pyvista.PolyData):
        return seen | {"x": data.points.tolist(), "vertices": data.verts.tolist()}
    return seen | {"origin": list(data.origin), "spacing": list(data.spacing), "size": list(data.dimensions)}


def mda_dump():
    return MDAnalysis.Universe(dump, topology_format="LAMMPSDUMP", format="LAMMPSDUMP", convert_units=False)


universe = mda_dump()
universe.trajectory[-1]
rdf = InterRDF(universe.atoms, universe.atoms, nbins=bins, range=(0, reach), exclusion_block=(1, 1), norm="none")
rdf.run(start=len(universe.trajectory) - 1)
last = ase.io.read(xyz, index=-1, format="extxyz")
g, _ = ase.geometry.rdf.get_rdf(last, reach, bins)

json.dump(
    {
        "versions": [MDAnalysis.__version__, ase.__version__],
        "mda_dump": mda(universe),
        "mda_xyz": mda(MDAnalysis.Universe(xyz, topology_format="XYZ", format="XYZ"), velocities=False),
        "mda_data": mda(
            MDAnalysis.Universe(data, topology_format="DATA", format="DATA", atom_style=style, convert_units=False)
        ),
        "ase_dump": [by_ase(a) for a in ase.io.read(dump, index=":", format="lammps-dump-text")],
        "ase_xyz": [by_ase(a) for a in ase.io.read(xyz, index=":", format="extxyz")],
        "ase_data": [by_ase(ase.io.read(data, format="lammps-data", style="atomic", units="metal"))],
        "gsd": [by_gsd(frame) for frame in gsd.hoomd.open(f"{folder}/trajectory.gsd")],
        "mda_gsd": mda(MDAnalysis.Universe(f"{folder}/trajectory.gsd"), velocities=False),
        "vtp": [by_pyvista(path) for path in sorted(glob.glob(f"{folder}/vtk/*.vtp"))],
        "vti": [by_pyvista(path) for path in sorted(glob.glob(f"{folder}/vtk/*.vti"))],
        "mda_pairs": rdf.results.count.tolist(),
        "ase_g": numpy.asarray(g).tolist(),
    },
    sys.stdout,
    # Numbers of numpy.
    default=lambda number: number.item(),
)
