"""The compiled part of psidpd."""

from collections.abc import Sequence
from os import PathLike
from typing import Literal, final

import numpy
import pandas
from numpy.typing import ArrayLike, NDArray

__all__ = ["Engine", "Evaluation", "Model", "Steps", "estimate", "main", "run_scene", "version"]

@final
class Model:
    @staticmethod
    def from_file(path: str | PathLike[str]) -> Model: ...
    @staticmethod
    def from_text(text: str, name: str = "model") -> Model: ...
    @property
    def title(self) -> str: ...
    @property
    def reference(self) -> str | None: ...
    @property
    def dimensions(self) -> int: ...
    @property
    def species(self) -> list[str]: ...
    @property
    def parameters(self) -> dict[str, float]: ...
    @property
    def text(self) -> str: ...
    def pressure(self, rho: ArrayLike, kT: float) -> float | NDArray[numpy.float64]: ...
    def phase_diagram(self, kT: ArrayLike, density: float | None = None) -> pandas.DataFrame: ...

@final
class Evaluation:
    @property
    def energy(self) -> float: ...
    @property
    def virial(self) -> NDArray[numpy.float64]: ...
    @property
    def densities(self) -> NDArray[numpy.float64]: ...
    @property
    def forces(self) -> NDArray[numpy.float64]: ...

@final
class Engine:
    def __new__(
        cls, model: Model, kT: float, *, precision: Literal["double", "mixed"] = "double", threads: int = 1
    ) -> Engine: ...
    @property
    def cutoff(self) -> float: ...
    def evaluate(
        self,
        x: ArrayLike,
        box: ArrayLike,
        types: ArrayLike | Sequence[str] | None = None,
        *,
        periodic: Sequence[bool] | None = None,
    ) -> Evaluation: ...

@final
class Steps:
    def __new__(
        cls,
        path: str | PathLike[str] | None,
        text: str | None,
        base: str | PathLike[str],
        threads: int,
        precision: str | None,
        device: str | None,
    ) -> Steps: ...
    def run(self, steps: int | None) -> None: ...
    @property
    def left(self) -> int: ...
    @property
    def positions(self) -> NDArray[numpy.float64]: ...
    @property
    def velocities(self) -> NDArray[numpy.float64]: ...
    @property
    def forces(self) -> NDArray[numpy.float64]: ...
    @property
    def types(self) -> NDArray[numpy.int32]: ...
    @property
    def species(self) -> list[str]: ...
    @property
    def box(self) -> list[list[float]]: ...
    @property
    def now(self) -> tuple[int, float, str, float, float, float, float, list[float]]: ...

def estimate(series: ArrayLike) -> tuple[float, float]: ...
def run_scene(
    path: str | PathLike[str] | None,
    text: str | None,
    base: str | PathLike[str],
    out: str | PathLike[str],
    threads: int,
    precision: str | None,
    device: str | None,
    begin: Literal["new", "resume", "overwrite"],
    report: bool,
) -> None: ...
def sweep(
    scene: str | PathLike[str],
    over: Sequence[tuple[str, Sequence[str]]],
    out: str | PathLike[str],
    jobs: int | None,
    threads: int,
    overwrite: bool,
) -> None: ...
def read_positions(path: str | PathLike[str]) -> NDArray[numpy.float64]: ...
def headline(
    folder: str | PathLike[str],
) -> tuple[
    list[tuple[str, float, float | None, str, str, float | None, list[float] | None]],
    list[str],
]: ...
def main(program: str | PathLike[str], arguments: Sequence[str]) -> int: ...
def version() -> str: ...
