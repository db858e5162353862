"""Reads the last frame of trajectory.gsd with gsd, and of dump.lammpstrj with ASE and MDAnalysis, in a folder; writes JSON."""

import json
import sys
import warnings

import ase.io
import gsd.hoomd
import MDAnalysis

warnings.simplefilter("ignore")

folder = sys.argv[1]
frame = gsd.hoomd.open(f"{folder}/trajectory.gsd")[-1]
frame.validate()
atoms = ase.io.read(f"{folder}/dump.lammpstrj", index=-1, format="lammps-dump-text")
mda = MDAnalysis.Universe(f"{folder}/dump.lammpstrj", format="LAMMPSDUMP", lammps_coordinate_convention="unscaled")
mda.trajectory[-1]
json.dump(
    {
        "gsd": frame.configuration.box.tolist(),
        "dimensions": int(frame.configuration.dimensions),
        "x": frame.particles.position.tolist(),
        "v": frame.particles.velocity.tolist(),
        "mass": frame.particles.mass.tolist(),
        "ase": atoms.cell.tolist(),
        "mda": mda.trajectory.ts.triclinic_dimensions.tolist(),
    },
    sys.stdout,
)
