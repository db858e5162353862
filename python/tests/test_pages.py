"""The Python of the pages runs as it stands, in the checkout; blocks of a page follow each other."""

import os
import re
import subprocess
import sys

import pytest
from conftest import ROOT

PAGES = [page for page in [ROOT / "README.md", ROOT / "python" / "README.md", *sorted((ROOT / "docs").glob("*.md"))] if "```python" in page.read_text()]

# The page on output needs files of a run, which tests/tests/read_back.rs reads. Notebooks are run by test_notebooks.py.
ELSEWHERE = {"output.md", *(page.name for page in (ROOT / "docs").glob("notebook-*.md"))}


@pytest.mark.parametrize("page", [p for p in PAGES if p.name not in ELSEWHERE], ids=lambda page: str(page.relative_to(ROOT)))
def test_the_python_of_a_page_runs(page):
    blocks = re.findall(r"^```python\n(.*?)^```", page.read_text(), re.M | re.S)
    environment = dict(os.environ, MPLBACKEND="agg")
    command = [sys.executable, "-c", "\n".join(blocks)]
    run = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    # What a page says that a block prints.
    if run.stdout:
        assert run.stdout.strip() in page.read_text()


def test_the_program_prints_what_the_tutorial_shows(tmp_path):
    page = (ROOT / "docs" / "tutorial.md").read_text()
    (tmp_path / "fluid.toml").write_text(re.search(r"^```toml\n(# fluid.toml\n.*?)^```", page, re.M | re.S).group(1))
    command = [sys.executable, "-m", "psidpd", "theory", "fluid.toml", "--kT", "0.9"]
    printed = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout.splitlines()
    shown = re.search(r"^```text\n(critical point.*?)^```", page, re.M | re.S).group(1).splitlines()
    assert set(shown) <= set(printed)


def test_there_are_pages():
    assert {"README.md", "python.md", "units.md"} <= {page.name for page in PAGES}
