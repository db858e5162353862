"""A preprocessor of mdBook: fenced blocks of `math`, and formulas in a line between $` and `$, in LaTeX, become MathML, which
browsers typeset without a script, a font or a network. Both are typeset where the pages are read on a forge too."""

import json
import re
import sys

from math_core import LatexToMathML

if sys.argv[1:2] == ["supports"]:
    sys.exit(sys.argv[2] != "html")

to_mathml = LatexToMathML()
FENCED = re.compile(r"(^```.*?^```$)", re.DOTALL | re.MULTILINE)
BLOCK = re.compile(r"^```math\n(.*?)^```$", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"\$`([^`\n]+)`\$")


def mathml(latex, displaystyle):
    # An empty line would end what markdown takes for HTML.
    return to_mathml.convert_with_local_state(latex, displaystyle=displaystyle).replace("\n", "")


def equation(block):
    return f'<div class="equation">{mathml(block[1], True)}</div>\n'


def formula(span):
    # Markdown reads what stands between tags in a line, and tables end their cells there.
    return re.sub(r"[|*_\[\]\\`~]", lambda sign: f"&#{ord(sign[0])};", mathml(span[1], False))


def typeset(chapter):
    """Replaces the equations of a chapter and of those below it."""
    parts = FENCED.split(chapter["content"])
    for k, part in enumerate(parts):
        parts[k] = BLOCK.sub(equation, part) if part.startswith("```") else INLINE.sub(formula, part)
    chapter["content"] = "".join(parts)
    for item in chapter["sub_items"]:
        if "Chapter" in item:
            typeset(item["Chapter"])


context, book = json.load(sys.stdin)
for item in book.get("items", book.get("sections", [])):
    if "Chapter" in item:
        typeset(item["Chapter"])
json.dump(book, sys.stdout)
