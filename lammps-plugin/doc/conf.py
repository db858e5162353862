"""How Sphinx makes pages of these files that look like LAMMPS's own: see build-html."""

project = "psidpd in LAMMPS"
extensions = ["myst_parser", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
html_theme = "sphinx_rtd_theme"
html_show_sourcelink = False
html_copy_source = False
