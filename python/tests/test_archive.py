"""The archive of the sources that pip makes, from which the package is built elsewhere."""

import os
import re
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
from conftest import ROOT

SITE = "https://github.com/psidpd/psidpd"


@pytest.mark.parametrize("page", ["python/README.md", "rust-core/README.md"])
def test_links_of_a_registry_s_page_are_absolute_and_lead_to_files(page):
    links = re.findall(r"\]\(([^)]*)\)", (ROOT / page).read_text())
    assert links
    for link in links:
        path = re.fullmatch(SITE + "(?:/(?:blob|raw)/main/(.*))?", link)
        assert path and (ROOT / (path.group(1) or "README.md")).is_file(), link


def test_cargo_takes_the_lock_file_of_the_archive(tmp_path):
    # maturin is a program beside this Python.
    path = os.environ["PATH"] + os.pathsep + str(Path(sys.executable).parent)
    code = "import backend, sys; backend.build_sdist(sys.argv[1])"
    environment = dict(os.environ, PATH=path, PYTHONPATH=str(ROOT / "python"), PYTHONDONTWRITEBYTECODE="1")
    subprocess.run([sys.executable, "-c", code, tmp_path], cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)
    [archive] = tmp_path.glob("psidpd-*.tar.gz")
    with tarfile.open(archive) as files:
        names = {name.split("/", 1)[1] for name in files.getnames()}
        files.extractall(tmp_path)
    top = tmp_path / archive.name.removesuffix(".tar.gz")
    subprocess.run(["cargo", "metadata", "--locked", "--format-version", "1"], cwd=top, check=True, stdout=subprocess.DEVNULL)
    # What the wheel and the pair styles are built with; nothing that was built.
    assert {"PKG-INFO", "pyproject.toml", "python/backend.py", "lammps-plugin/python/backend.py"} <= names
    assert not [name for name in names if "target" in name.split("/") or name.endswith(".so")]
