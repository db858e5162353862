"""Simulations that Python steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal

from . import _psidpd
from .errors import InputError
from .scenes import AnyPath, AnyScene, opened

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray


class Simulation:
    """A scene in memory, which is stepped from Python and writes no files.

        simulation = psidpd.Simulation("scene.toml")
        simulation.run(1000, every=100, callback=lambda s: print(s.step, s.temperature))
        simulation.positions

    scene : path of a scene file, its text, or a dictionary with its keys, as for `psidpd.run`.
    base : the folder from which paths in a text or a dictionary start, else the present one.
    threads : how many share the work. Numbers do not depend on it.
    precision : "mixed" or "double". If left out, that of the scene, or else mixed.
    device : "cpu", "gpu" or "gpu:N". If left out, that of the scene, or else the CPU.

    The trajectory is that of `psidpd.run`, to the last bit. Output and observables of the scene are left out.

    Raises InputError for a scene or a model that cannot be used.
    """

    def __init__(
        self,
        scene: AnyScene,
        *,
        base: AnyPath | None = None,
        threads: int = 1,
        precision: Literal["mixed", "double"] | None = None,
        device: str | None = None,
    ) -> None:
        self._steps = _psidpd.Steps(*opened(scene, base), threads, precision, device)

    def __repr__(self) -> str:
        return f"<psidpd.Simulation of {len(self.types)} particles after step {self.step}>"

    def run(
        self,
        steps: int | None = None,
        *,
        every: int | None = None,
        callback: Callable[[Simulation], Any] | None = None,
    ) -> None:
        """Makes steps, to the end of the scene if their number is left out.

        The stages of the scene follow each other; further steps are like those of the last stage. `callback` is called
        with the simulation after every `every` steps of this call and after the last; an exception of it ends the
        call. Ctrl-C ends it after the present step and raises KeyboardInterrupt; the simulation can go on from there.
        The pressure then lacks drag and noise until the thermostat acts again, if `thermostat_every` is above 1 and it does not
        act in that step.

        Raises RunStoppedError where the physics fails.
        """
        if steps is not None and steps < 0:
            raise InputError(f"steps must not be negative, is {steps}")
        if (every is None) != (callback is None) or (every is not None and every < 1):
            raise InputError("every, a number of steps from 1, and callback belong together")
        if every is None or callback is None:
            self._steps.run(steps)
            return
        left = self._steps.left if steps is None else steps
        while left > 0:
            self._steps.run(min(every, left))
            left -= every
            callback(self)

    @property
    def positions(self) -> NDArray[numpy.float64]:
        """Positions, wrapped into the box: shape (N, 3), in the order of the particles' tags.

        It is the same read-only array at every call, and its numbers follow the run; `.copy()` keeps them. So are
        `velocities` and `forces`.
        """
        return self._steps.positions

    @property
    def velocities(self) -> NDArray[numpy.float64]:
        """Velocities at the end of the present step: shape (N, 3)."""
        return self._steps.velocities

    @property
    def forces(self) -> NDArray[numpy.float64]:
        """The forces that the present step ended with: shape (N, 3). Drag and noise are in them where the integrator has them
        among its forces, as velocity Verlet."""
        return self._steps.forces

    @property
    def types(self) -> NDArray[numpy.int32]:
        """The index of each particle's species in `species`, from 0."""
        return self._steps.types

    @property
    def species(self) -> list[str]:
        """The names of the model's species."""
        return self._steps.species

    @property
    def box(self) -> list[list[float]]:
        """The edge vectors of the box."""
        return self._steps.box

    @property
    def step(self) -> int:
        """The number of steps made."""
        return self._steps.now[0]

    @property
    def time(self) -> float:
        """The time since the first step."""
        return self._steps.now[1]

    @property
    def stage(self) -> str:
        """The name of the present stage."""
        return self._steps.now[2]

    @property
    def kT(self) -> float:
        """The temperature of the present stage, as kT."""
        return self._steps.now[3]

    @property
    def temperature(self) -> float:
        """The kinetic temperature, as kT."""
        return self._steps.now[4]

    @property
    def potential_energy(self) -> float:
        """The potential energy U = Σ ψ + Σ φ."""
        return self._steps.now[5]

    @property
    def kinetic_energy(self) -> float:
        """The kinetic energy Σ ½ m v²."""
        return self._steps.now[6]

    @property
    def pressure(self) -> list[float]:
        """The pressure tensor (Σ m v v + W)/V, drag and noise included: xx, yy, zz, xy, xz, yz."""
        return self._steps.now[7]
