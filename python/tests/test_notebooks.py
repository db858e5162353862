"""The cells of the notebooks run, one after the other, in a fresh folder."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(notebook, tmp_path):
    cells = json.loads(notebook.read_text())["cells"]
    if "lammps" in notebook.stem and os.environ.get("PSIDPD_WITH_LAMMPS") != "1":
        pytest.importorskip("lammps")
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    program = tmp_path / "cells.py"
    program.write_text("\n\n".join(code))
    # MPI of the environment, for LAMMPS in Python; plots go nowhere.
    library = os.path.join(sys.prefix, "lib")
    environment = dict(os.environ, MPLBACKEND="agg", LD_LIBRARY_PATH=library, PSIDPD_CHECKOUT=str(notebook.parents[2]))
    run = subprocess.run([sys.executable, program], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
