"""Runs, and what they leave."""

from __future__ import annotations

import io
import json
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from . import _psidpd
from .errors import InputError
from .files import read
from .scenes import AnyPath, AnyScene, opened, toml

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy
    from numpy.typing import NDArray
    from pandas import DataFrame


def run(
    scene: AnyScene,
    out: AnyPath | None = None,
    *,
    base: AnyPath | None = None,
    threads: int = 1,
    precision: Literal["mixed", "double"] | None = None,
    device: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    report: bool = False,
) -> Result:
    """Runs a scene and returns its Result, as `psidpd run SCENE --out OUT` does.

    scene : path of a scene file, its text, or a dictionary with its keys: {"model": "fluid.toml", "kT": 1.0, …}. A text has at
        least one line break. Paths in a text or a dictionary start from `base`, or else from the present folder.
    out : the folder for all files; left out, a temporary one that lives as long as the Result.
    threads : how many share the work. What a run writes does not depend on it.
    precision : "mixed" or "double". If left out, that of the scene, or else mixed.
    device : "cpu", "gpu" or "gpu:N". If left out, that of the scene, or else the CPU. GPUs need a package that was built for
        them: docs/gpu.md.
    resume : go on from the last checkpoint in `out`. A run that is finished is read, or prolonged if the last stage of the scene has
        more steps than it had.
    overwrite : start over in a folder with another run.
    report : make report.html too.

    Ctrl-C ends the run after the present step with a checkpoint and raises KeyboardInterrupt. Other threads of Python go
    on meanwhile.

    Raises InputError for a scene, a model or a folder that cannot be used, and RunStoppedError for a run that stops on
    its way.
    """
    if resume and overwrite:
        raise InputError("resume and overwrite exclude each other")
    begin = "resume" if resume else "overwrite" if overwrite else "new"
    temporary = None
    if out is None:
        if resume:
            raise InputError("to resume a run, say where it is: out=…")
        temporary = tempfile.TemporaryDirectory(prefix="psidpd-")
    folder = Path(out if temporary is None else temporary.name)
    _psidpd.run_scene(*opened(scene, base), folder, threads, precision, device, begin, report)
    return Result(folder, temporary)


def sweep(
    scene: AnyPath,
    over: Mapping[str, Sequence[Any]],
    out: AnyPath,
    *,
    jobs: int | None = None,
    threads: int = 1,
    overwrite: bool = False,
) -> DataFrame:
    """Runs a scene with every combination of values of its keys, several runs at a time, as `psidpd sweep` does.

    scene : path of a scene file.
    over : values of keys of the scene or of its model: {"kT": [0.8, 1.0], "model.parameters.B": [20, 25]}.
    out : the folder of the runs; each has a folder of its own there, beside sweep.csv and report.html.
    jobs : runs side by side; processors over threads if left out.
    overwrite : start over where runs are. Otherwise finished runs are taken as they are.

    Returns the table of sweep.csv: keys, results and their errors, and the folder of each run. Ctrl-C ends the runs with
    checkpoints and raises KeyboardInterrupt; the same call goes on from there.

    Raises InputError for a scene or values that cannot be used. A run that fails has `finished` False in the table.
    """
    import pandas

    axes = [(key, [value if isinstance(value, str) else toml(value) for value in values]) for key, values in over.items()]
    _psidpd.sweep(os.fspath(scene), axes, os.fspath(out), jobs, threads, overwrite)
    return pandas.read_csv(io.StringIO(read(Path(out) / "sweep.csv")))


class Result:
    """What a run left in its folder, read when it is asked for. `Result("slab")` is that of an earlier run."""

    def __init__(self, folder: AnyPath, _temporary: tempfile.TemporaryDirectory[str] | None = None) -> None:
        self.folder = Path(folder)
        self._temporary = _temporary
        if not (self.folder / "about.json").is_file():
            raise InputError(f"{self.folder} is not the folder of a run: it has no about.json")

    def __repr__(self) -> str:
        return f"<psidpd.Result of {self.about['title']!r} in {str(self.folder)!r}>"

    def _json(self, name: str) -> Any:
        text = read(self.folder / name)
        return None if text is None else json.loads(text)

    @property
    def about(self) -> dict[str, Any]:
        """What was run: species, box, stages, units; the contents of about.json."""
        return self._json("about.json")

    @property
    def summary(self) -> dict[str, Any] | None:
        """The contents of summary.json, or None for a run that is not finished."""
        return self._json("summary.json")

    @property
    def headline(self) -> DataFrame:
        """The results that are looked for first, as `psidpd run` prints them at its end: a DataFrame by name.

        Columns are `value`, `error` (one standard deviation; NaN where it is exact or not known), `unit`, `source`,
        `mean_field`, `published` and `published_error`. `.attrs["notes"]` says what to know before using them: a series
        that is too short, or drifts, a cluster that percolates, a drop that touches its image.
        """
        import pandas

        values, notes = _psidpd.headline(self.folder)
        columns = ["value", "error", "unit", "source", "mean_field", "published", "published_error"]
        rows = {name: [*row, *(known or [None, None])] for name, *row, known in values}
        table = pandas.DataFrame.from_dict(rows, orient="index", columns=columns)
        numbers = [name for name in columns if name not in ("unit", "source")]
        table = table.astype(dict.fromkeys(numbers, float))
        table.attrs["notes"] = notes
        return table

    @property
    def positions(self) -> NDArray[numpy.float64]:
        """Positions after the last step, wrapped into the box: shape (N, 3), in the order of the particles' tags.

        Raises InputError for a run that is not finished.
        """
        path = self.folder / "final.data"
        if path.is_symlink() or not path.is_file():
            raise InputError(f"{self.folder} has no final.data: the run is not finished")
        return _psidpd.read_positions(path)

    @property
    def thermo(self) -> DataFrame:
        """The totals of thermo.csv, a DataFrame with one row for every `thermo` steps. Units are in `.attrs["units"]`."""
        import pandas

        text = read(self.folder / "thermo.csv")
        if text is None:
            raise InputError(f"{self.folder} has no thermo.csv: the scene asks for none")
        table = pandas.read_csv(io.StringIO(text))
        table.attrs["units"] = {column["name"]: column["unit"] for column in self.about["thermo"]}
        return table

    @property
    def means(self) -> DataFrame:
        """Means over the rows of the last stage with their errors: a DataFrame with the columns `value` and `error`.

        Errors are one standard deviation and count correlated rows as what they are; NaN for fewer than 8 rows.
        """
        import pandas

        rows = self.thermo
        stage = self.about["stages"][-1]
        rows = rows[(rows["step"] > stage["begin"]) & (rows["step"] <= stage["end"])]
        found = {name: _psidpd.estimate(rows[name]) for name in rows if name not in ("step", "time") and len(rows)}
        return pandas.DataFrame.from_dict(found, orient="index", columns=["value", "error"])

    @property
    def observables(self) -> dict[str, DataFrame]:
        """What `[observe]` asked for: DataFrames by name, each column NAME followed by NAME_error.

        Where several stages have the same observable their names are NAME-STAGE. `.attrs` has `title`, `stage`, `kind`,
        `samples`, `note` and `units`. Scalars are tables of one row.
        """
        import pandas

        found = {}
        all_of_them = self._json("observables.json") or []
        names = [o["name"] for o in all_of_them]
        for o in all_of_them:
            columns, units = {}, {}
            if o["x"] is not None:
                columns[o["x"]["name"]] = o["x"]["values"]
                units[o["x"]["name"]] = o["x"]["unit"]
            for column in o["columns"]:
                columns[column["name"]] = column["values"]
                columns[column["name"] + "_error"] = column["errors"]
                units[column["name"]] = column["unit"]
            table = pandas.DataFrame({name: pandas.Series(values, dtype=float) for name, values in columns.items()})
            table.attrs.update({key: o[key] for key in ("title", "stage", "kind", "samples", "note")}, units=units)
            name = o["name"] if names.count(o["name"]) == 1 else f"{o['name']}-{o['stage']}"
            found[name] = table
        return found

    def value(self, name: str) -> tuple[float, float]:
        """Value and error of a number by its name: (value, error).

        A name is OBSERVABLE.COLUMN, as "surface_tension.stress", OBSERVABLE alone where it has one column, or a column of
        thermo.csv, whose mean over the last stage it is then. Raises KeyError, which lists the names that there are, for
        any other.
        """
        numbers = {}
        for observable, table in self.observables.items():
            if table.attrs["kind"] != "scalar":
                continue
            columns = [column for column in table if column + "_error" in table]
            for column in columns:
                pair = (float(table[column].iloc[0]), float(table[column + "_error"].iloc[0]))
                numbers[f"{observable}.{column}"] = pair
                if len(columns) == 1:
                    numbers[observable] = pair
        for column, row in self.means.iterrows():
            numbers.setdefault(column, (float(row["value"]), float(row["error"])))
        if name not in numbers:
            raise KeyError(f"no number {name!r}; there are {', '.join(sorted(numbers))}")
        return numbers[name]
