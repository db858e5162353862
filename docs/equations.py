"""A preprocessor of mdBook: fenced blocks of `math`, in LaTeX, become MathML, which browsers typeset without a script, a font
or a network. The same blocks are typeset where the pages are read on a forge."""

import json
import re
import sys

from math_core import LatexToMathML

if sys.argv[1:2] == ["supports"]:
    sys.exit(sys.argv[2] != "html")

to_mathml = LatexToMathML()
BLOCK = re.compile(r"^```math\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def typeset(chapter):
    """Replaces the equations of a chapter and of those below it."""

    def equation(block):
        mathml = to_mathml.convert_with_local_state(block[1], displaystyle=True)
        # An empty line would end what markdown takes for HTML.
        return f'<div class="equation">{mathml.replace(chr(10), "")}</div>\n'

    chapter["content"] = BLOCK.sub(equation, chapter["content"])
    for item in chapter["sub_items"]:
        if "Chapter" in item:
            typeset(item["Chapter"])


context, book = json.load(sys.stdin)
for item in book.get("items", book.get("sections", [])):
    if "Chapter" in item:
        typeset(item["Chapter"])
json.dump(book, sys.stdout)
