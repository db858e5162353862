"""What the tests share: the models of the checkout, and configurations of their fluids."""

from pathlib import Path

import numpy
import psidpd
import pytest

ROOT = Path(__file__).resolve().parents[2]
MODELS = ROOT / "validation" / "models"


@pytest.fixture(scope="session")
def warren():
    return psidpd.Model.from_file(MODELS / "warren2003-set6.toml")


@pytest.fixture(scope="session")
def huggins():
    return psidpd.Model.from_file(MODELS / "huggins.toml")


@pytest.fixture
def points():
    """Places of 200 particles in a box of edge 4, none too near to another."""
    random = numpy.random.default_rng(7)
    grid = numpy.stack(numpy.meshgrid(*[numpy.arange(6)] * 3), -1).reshape(-1, 3)[:200]
    return (grid + random.uniform(0.2, 0.8, grid.shape)) * (4.0 / 6.0)


def scene(steps=60, observe="", model="warren2003-set6.toml"):
    """A small scene, as a text."""
    return (
        f'model = "{MODELS / model}"\nkT = 1.0\nbox = 4.0\ndensity = 6.05\nsteps = {steps}\n'
        f"[output]\nthermo = 5\n{observe}"
    )
