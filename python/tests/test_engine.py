import json
import subprocess
import sys
import threading

import numpy
import psidpd
import pytest
from conftest import MODELS


def test_forces_are_differences_of_the_energy(warren, points):
    engine = psidpd.Engine(warren, kT=1.0)
    forces = engine.evaluate(points, 4.0).forces
    h = 1e-5
    for particle, axis in [(0, 0), (17, 1), (101, 2), (199, 0)]:
        energy = []
        for sign in (1, -1):
            moved = points.copy()
            moved[particle, axis] += sign * h
            energy.append(engine.evaluate(moved, 4.0).energy)
        assert forces[particle, axis] == pytest.approx((energy[1] - energy[0]) / (2 * h), rel=1e-6, abs=1e-6)


def test_the_virial_is_the_strain_derivative_of_the_energy(warren, points):
    engine = psidpd.Engine(warren, kT=1.0)
    virial = engine.evaluate(points, 4.0).virial
    h = 1e-6
    for k, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]):
        energy = []
        for sign in (1, -1):
            strain = numpy.eye(3)
            strain[i, j] += sign * h
            energy.append(engine.evaluate(points @ strain.T, 4.0 * strain.T).energy)
        assert virial[k] == pytest.approx((energy[1] - energy[0]) / (2 * h), rel=1e-5, abs=1e-3)


@pytest.mark.parametrize("name", ["warren2003-set6", "huggins"])
def test_the_command_line_has_the_same_numbers(tmp_path, points, name):
    model = psidpd.Model.from_file(MODELS / f"{name}.toml")
    kinds = numpy.arange(len(points)) % len(model.species)
    lines = ["from a test", "", f"{len(points)} atoms", f"{len(model.species)} atom types", ""]
    lines += [f"0 4 {a}lo {a}hi" for a in "xyz"] + ["", "Atoms # atomic", ""]
    lines += [f"{i + 1} {k + 1} {x!r} {y!r} {z!r}" for i, (k, (x, y, z)) in enumerate(zip(kinds, points.tolist()))]
    (tmp_path / "atoms.data").write_text("\n".join(lines) + "\n")
    command = [sys.executable, "-m", "psidpd", "forces", "--model", MODELS / f"{name}.toml", "--data", "atoms.data"]
    subprocess.run([*command, "--kT", "1", "--json", "f.json"], cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)
    expected = json.loads((tmp_path / "f.json").read_text())
    found = psidpd.Engine(model, 1.0).evaluate(points, [4.0, 4.0, 4.0], kinds)
    assert found.energy == pytest.approx(expected["energy"], rel=1e-12)
    assert found.virial == pytest.approx(expected["virial"], rel=1e-10, abs=1e-8)
    assert found.densities == pytest.approx(numpy.array(expected["density"]), rel=1e-12, abs=1e-12)
    size = numpy.abs(expected["forces"]).max()
    assert found.forces == pytest.approx(numpy.array(expected["forces"]), abs=1e-11 * size)


def test_arrays_of_any_layout_give_the_same(warren, huggins, points):
    engine = psidpd.Engine(warren, 1.0)
    plain = engine.evaluate(points, 4.0).forces
    strided = numpy.repeat(points, 2, axis=0)[::2]
    assert not strided.flags.c_contiguous
    for same in (numpy.asfortranarray(points), strided, points.tolist()):
        assert (engine.evaluate(same, 4.0).forces == plain).all()
    single = engine.evaluate(points.astype(numpy.float32), 4.0).forces
    assert single == pytest.approx(plain, abs=1e-4 * numpy.abs(plain).max())
    # Images of a particle, boxes as matrices.
    assert engine.evaluate(points + [4.0, -8.0, 0.0], numpy.eye(3) * 4.0).forces == pytest.approx(plain, abs=1e-9)
    mixed = psidpd.Engine(warren, 1.0, precision="mixed", threads=2).evaluate(points, 4.0).forces
    assert mixed == pytest.approx(plain, abs=1e-4 * numpy.abs(plain).max())
    # Species by index of any whole type, and by name.
    engine = psidpd.Engine(huggins, 1.0)
    kinds = numpy.arange(len(points)) % 2
    by_index = engine.evaluate(points, 4.0, kinds.astype(numpy.uint8)).forces
    by_name = engine.evaluate(points, 4.0, [huggins.species[k] for k in kinds]).forces
    assert (by_index == by_name).all()
    assert (by_index != engine.evaluate(points, 4.0).forces).any()


def test_positions_are_left_alone_and_forces_are_owned(warren, points):
    before = points.copy()
    engine = psidpd.Engine(warren, 1.0)
    found = engine.evaluate(points, 4.0)
    assert (points == before).all()
    kept = found.forces.copy()
    engine.evaluate(points[:10], 4.0)
    assert (found.forces == kept).all() and found.forces.flags.writeable
    points.flags.writeable = False
    assert (engine.evaluate(points, 4.0).forces == kept).all()


def test_two_dimensions(points):
    model = psidpd.Model.from_file(MODELS / "van-der-waals-2d.toml")
    engine = psidpd.Engine(model, 1.0)
    flat = points[:30, :2] * 2
    found = engine.evaluate(flat, [8.0, 8.0])
    assert found.forces.shape == (30, 2)
    solid = engine.evaluate(numpy.column_stack([flat, numpy.zeros(30)]), [8.0, 8.0, 1.0])
    assert (solid.forces[:, :2] == found.forces).all() and solid.energy == found.energy


@pytest.mark.parametrize(
    "arguments, said",
    [
        ((numpy.zeros((3, 5)), 4.0), r"shape \(N, 3\), has \(3, 5\)"),
        ((numpy.zeros(3), 4.0), r"shape \(N, 3\), has \(3,\)"),
        ((numpy.zeros((2, 3), complex), 4.0), "real numbers"),
        ((numpy.array([["a", "b", "c"]]), 4.0), "real numbers"),
        ((numpy.zeros((2, 3)), [4.0, 4.0]), "box must be"),
        ((numpy.zeros((2, 3)), -1.0), "box"),
        ((numpy.zeros((2, 3)), numpy.nan), "box"),
        ((numpy.zeros((2, 3)), 0.001), "range"),
        ((numpy.zeros((2, 3)), 4.0, [0]), r"types must have the shape \(2,\)"),
        ((numpy.zeros((2, 3)), 4.0, [0, 7]), "7 is not the number of a species"),
        ((numpy.zeros((2, 3)), 4.0, [0, -1]), "-1 is not the number of a species"),
        ((numpy.zeros((2, 3)), 4.0, [0.0, 0.5]), "whole numbers"),
        ((numpy.zeros((2, 3)), 4.0, [0, 2**33]), "too large"),
        ((numpy.zeros((2, 3)), 4.0, ["F", "G"]), '"G" is not a species'),
        ((numpy.zeros((2, 3)), 4.0, "F"), "the single text 'F'"),
        ((numpy.zeros((2, 3)), 4.0, numpy.array("F")), "whole numbers"),
        ((numpy.ma.masked_invalid([[0.0, 0.0, 0.0], [1.0, 1.0, numpy.nan]]), 4.0), "x is a masked array"),
        ((numpy.zeros((2, 3)), 4.0, numpy.ma.array([0, 0], mask=[0, 1])), "types is a masked array"),
        ((numpy.full((2, 3), numpy.nan), 4.0), "position"),
    ],
)
def test_what_does_not_fit_is_refused(warren, arguments, said):
    with pytest.raises(psidpd.InputError, match=said):
        psidpd.Engine(warren, 1.0).evaluate(*arguments)


def test_settings_that_are_none_are_refused(warren):
    with pytest.raises(psidpd.InputError, match="precision"):
        psidpd.Engine(warren, 1.0, precision="half")
    with pytest.raises(psidpd.InputError, match="threads"):
        psidpd.Engine(warren, 1.0, threads=0)
    with pytest.raises(psidpd.InputError):
        psidpd.Engine(warren, kT=0.0)


def test_nothing_is_something(warren):
    found = psidpd.Engine(warren, 1.0).evaluate(numpy.zeros((0, 3)), 4.0)
    assert found.energy == 0.0 and found.forces.shape == (0, 3)


def test_threads_of_python_may_share_an_engine(warren, points):
    engine = psidpd.Engine(warren, 1.0)
    expected = engine.evaluate(points, 4.0).forces
    wrong = []

    def work():
        for _ in range(20):
            if not (engine.evaluate(points, 4.0).forces == expected).all():
                wrong.append(1)

    workers = [threading.Thread(target=work) for _ in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert not wrong


# Twenty seconds, then a signal ends what hangs.
FORKED = """
import os, signal, sys, threading, numpy, psidpd
engine = psidpd.Engine(psidpd.Model.from_file(sys.argv[1]), 1.0, threads=2)
x = numpy.random.default_rng(7).uniform(0.0, 8.0, (3000, 3))
before = engine.evaluate(x, 8.0).forces
child = os.fork()
if child == 0:
    signal.alarm(20)
    same = numpy.allclose(engine.evaluate(x, 8.0).forces, before, rtol=1e-9)
    tasks = len(os.listdir("/proc/self/task"))
    del engine
    os._exit(0 if same and tasks == 2 else 1)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


def test_an_engine_of_several_threads_works_in_a_forked_process():
    command = [sys.executable, "-c", FORKED, MODELS / "warren2003-set6.toml"]
    assert subprocess.run(command).returncode == 0


# Forks while a thread evaluates: the child cannot know in which state the engine is.
FORKED_MEANWHILE = """
import os, signal, sys, threading, time, numpy, psidpd
engine = psidpd.Engine(psidpd.Model.from_file(sys.argv[1]), 1.0, threads=2)
x = numpy.random.default_rng(7).uniform(0.0, 55.0, (1000000, 3))
thread = threading.Thread(target=engine.evaluate, args=(x, 55.0))
thread.start()
time.sleep(0.2)
child = os.fork()
if child == 0:
    signal.alarm(20)
    try:
        engine.evaluate(x[:10], 55.0)
    except psidpd.RunStoppedError as error:
        os._exit(0 if "spawn" in str(error) else 1)
    os._exit(2)
thread.join()
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


def test_an_engine_that_was_at_work_when_its_process_forked_says_so():
    command = [sys.executable, "-W", "ignore", "-c", FORKED_MEANWHILE, MODELS / "warren2003-set6.toml"]
    assert subprocess.run(command).returncode == 0
