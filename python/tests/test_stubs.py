"""The stubs name what there is."""

import ast
import inspect
from pathlib import Path

import psidpd
from psidpd import _psidpd

STUB = Path(psidpd.__file__).with_name("_psidpd.pyi")


def names(body):
    return {node.name for node in body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}


def test_the_stub_has_every_name_and_no_other():
    tree = ast.parse(STUB.read_text())
    assert names(tree.body) == set(_psidpd.__all__)
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            there = {name for name in vars(getattr(_psidpd, node.name)) if not name.startswith("_")}
            assert names(node.body) - {"__new__"} == there, node.name


def test_everything_public_says_what_it_is():
    for name in psidpd.__all__:
        thing = getattr(psidpd, name)
        assert inspect.getdoc(thing), name
        if inspect.isclass(thing):
            for part, member in vars(thing).items():
                # The class says what its fields are.
                is_field = part in getattr(thing, "__dataclass_fields__", {})
                doc = f" {part}" in inspect.getdoc(thing) if is_field else inspect.getdoc(member)
                assert part.startswith("_") or doc, f"{name}.{part}"
