"""How Sphinx makes pages of these files that look like LAMMPS's own: see build-html."""

from docutils import nodes
from math_core import LatexToMathML

project = "psidpd in LAMMPS"
extensions = ["myst_parser"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
html_theme = "sphinx_rtd_theme"
html_show_sourcelink = False
html_copy_source = False
html_math_renderer = "mathml"

to_mathml = LatexToMathML()


def equation(displaystyle):
    """Writes an equation as MathML, which browsers typeset without a script or a network."""

    def visit(writer, node):
        mathml = to_mathml.convert_with_local_state(node.astext(), displaystyle=displaystyle)
        # An equation wider than the page scrolls; it is not cut.
        wide = '<div style="overflow-x: auto; margin-bottom: 1em">{}</div>'
        writer.body.append(wide.format(mathml) if displaystyle else mathml)
        raise nodes.SkipNode

    return visit, None


def setup(app):
    """Sphinx calls this."""
    app.add_html_math_renderer("mathml", inline_renderers=equation(False), block_renderers=equation(True))
