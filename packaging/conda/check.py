"""Parses and renders recipe.yaml as rattler-build does, with the sysroot of conda-forge: names of keys, licences, expressions."""

from pathlib import Path

from rattler_build import RenderConfig, Stage0Recipe, VariantConfig

recipe = Stage0Recipe.from_yaml(Path(__file__).with_name("recipe.yaml").read_text())
[variant] = recipe.render(VariantConfig({"c_stdlib": ["sysroot"], "c_stdlib_version": ["2.28"]}), RenderConfig())
print("conda:", variant.recipe.package.name, variant.recipe.package.version)
