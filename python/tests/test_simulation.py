import os
import signal
import threading
import time
import warnings

import numpy
import psidpd
import pytest
from conftest import MODELS, scene

SCENE = {
    "model": MODELS / "warren2003-set6.toml",
    "kT": 1.0,
    "box": numpy.array([4.0, 4.0, 4.0]),
    "density": 6.05,
    "seed": 3,
    "stage": [
        {"name": "settle", "steps": 20, "dt": 0.005},
        {"name": "produce", "steps": 40, "dt": 0.02, "integrator": "two-stage", "kT": 1.2},
    ],
}


def test_steps_are_those_of_a_run():
    """Through two stages with other steps, integrators and temperatures, in pieces, to the last bit; also with two threads."""
    result = psidpd.run(SCENE)
    assert result.summary["steps"] == 60
    for threads in (1, 2):
        simulation = psidpd.Simulation(SCENE, threads=threads)
        seen = []
        simulation.run(30, every=7, callback=lambda s: seen.append((s.step, s.stage)))
        assert seen == [(7, "settle"), (14, "settle"), (21, "produce"), (28, "produce"), (30, "produce")]
        simulation.run()
        assert (simulation.step, simulation.kT) == (60, 1.2) and simulation.time == pytest.approx(20 * 0.005 + 40 * 0.02)
        assert numpy.array_equal(simulation.positions, result.positions)
        last = result.thermo.iloc[-1]
        assert simulation.temperature == last["temperature"] and simulation.pressure[0] == last["pxx"]
        assert simulation.potential_energy == pytest.approx(last["potential"], rel=1e-12)
        simulation.run(5)
        assert simulation.step == 65 and simulation.stage == "produce"


def test_arrays_follow_the_run_and_cannot_be_written():
    simulation = psidpd.Simulation(SCENE)
    x, v = simulation.positions, simulation.velocities
    before = x.copy()
    assert x.shape == (len(simulation.types), 3) and simulation.positions is x
    simulation.run(1)
    # One step of velocity Verlet moves a particle by about its velocity times the step.
    moved = x - before
    moved -= 4.0 * numpy.round(moved / 4.0)
    assert 0.0 < numpy.abs(moved).max() < 0.005 * 10.0 and simulation.velocities is v
    with pytest.raises(ValueError, match="read-only"):
        x[0] = 0.0
    assert numpy.array_equal(simulation.box, 4.0 * numpy.eye(3)) and simulation.species == ["F"]
    energy = 0.5 * (v**2).sum()
    assert simulation.kinetic_energy == pytest.approx(energy) and abs(v.sum(axis=0)).max() < 1e-9


def test_lent_arrays_cannot_be_resized():
    """Whatever a caller does with the arrays, the run writes to memory of its own, which lives as long as any array shows it."""
    simulation = psidpd.Simulation(SCENE)
    expected = psidpd.Simulation(SCENE)
    for name in ("positions", "velocities", "forces"):
        array = getattr(simulation, name)
        count = len(array)
        for shape in ((3, 3), (0, 3), (10 * count, 3)):
            with pytest.raises(ValueError):
                array.resize(shape, refcheck=False)
        for again in (array, array.view(), array[:], array.T):
            with pytest.raises(ValueError, match="WRITEABLE"):
                again.setflags(write=True)
        with pytest.raises(TypeError):
            memoryview(array.base)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            array.dtype = numpy.float32
        with pytest.raises(ValueError):
            array.resize((count, 3), refcheck=False)
    seen = [simulation.positions.view(numpy.float64).reshape(-1, 3), simulation.velocities[:0]]
    for run in (simulation, expected):
        run.run(3)
    assert numpy.array_equal(seen[0], expected.positions)
    # A view outlives the run and the array.
    view = simulation.positions[:9]
    kept = view.copy()
    del simulation
    other = [bytes(10_000) for _ in range(100)]
    assert numpy.array_equal(view, kept) and len(other) == 100
    # A caller may give the array other numbers; the run goes on.
    simulation = psidpd.Simulation(SCENE)
    array = simulation.positions
    array.__setstate__((1, (2,), numpy.dtype(float), False, bytes(16)))
    simulation.run(2)


def test_forces_while_another_thread_resizes_the_positions():
    engine = psidpd.Engine(psidpd.Model.from_file(MODELS / "warren2003-set6.toml"), kT=1.0)
    x = 12.0 * numpy.random.default_rng(1).random((10_000, 3))
    energy = engine.evaluate(x, 12.0).energy
    worker = threading.Thread(target=lambda: [engine.evaluate(x, 12.0) for _ in range(20) if len(x)])
    worker.start()
    time.sleep(0.02)
    x.resize((0, 3), refcheck=False)
    worker.join()
    x = 12.0 * numpy.random.default_rng(1).random((10_000, 3))
    assert engine.evaluate(x, 12.0).energy == pytest.approx(energy)


def test_forces_are_those_of_the_engine():
    """Two-stage steps keep drag and noise apart, so that what is left is the gradient of the energy."""
    simulation = psidpd.Simulation(SCENE | {"stage": [{"name": "run", "steps": 9, "dt": 0.02, "integrator": "two-stage"}]}, precision="double")
    simulation.run()
    model = psidpd.Model.from_file(MODELS / "warren2003-set6.toml")
    found = psidpd.Engine(model, kT=1.0).evaluate(simulation.positions, box=4.0)
    assert simulation.potential_energy == pytest.approx(found.energy, rel=1e-10)
    assert numpy.abs(simulation.forces - found.forces).max() < 1e-8


def test_ctrl_c_stops_at_once_and_keeps_the_state():
    # In the background of a script, programs are started deaf to it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    simulation = psidpd.Simulation(scene(10**9))
    threading.Thread(target=lambda: (time.sleep(0.4), os.kill(os.getpid(), signal.SIGINT))).start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        simulation.run()
    assert time.monotonic() - began < 10.0
    step = simulation.step
    assert step > 0
    simulation.run(3)
    assert simulation.step == step + 3 and 0.5 < simulation.temperature < 2.0
    whole = psidpd.Simulation(scene(10**9))
    whole.run(step + 3)
    assert numpy.array_equal(whole.positions, simulation.positions)


def test_what_cannot_be_done_is_said():
    simulation = psidpd.Simulation(SCENE)
    with pytest.raises(ZeroDivisionError):
        simulation.run(10, every=2, callback=lambda s: 1 / 0)
    assert simulation.step == 2
    for wrong in ({"steps": -1}, {"every": 2}, {"every": 0, "callback": print}):
        with pytest.raises(psidpd.InputError):
            simulation.run(**wrong)
    with pytest.raises(psidpd.InputError, match="kT"):
        psidpd.Simulation({**SCENE, "kT": -1.0})
    with pytest.raises(psidpd.InputError, match="set"):
        psidpd.run({**SCENE, "density": {6.05}})
    with pytest.raises(psidpd.RunStoppedError):
        psidpd.Simulation({**SCENE, "stage": [{"name": "run", "steps": 10, "dt": 1e6}]}).run()


def test_a_sweep_is_a_table(tmp_path):
    (tmp_path / "scene.toml").write_text(scene(40).replace("density = 6.05\n", "density = 5.0\n"))
    table = psidpd.sweep(tmp_path / "scene.toml", {"density": [5.0, 6.0], "kT": [1.0]}, tmp_path / "out")
    assert list(table["density"]) == [5.0, 6.0] and table["finished"].all()
    # 64 ρ particles.
    counts = [len(psidpd.Result(tmp_path / "out" / folder).positions) for folder in table["folder"]]
    assert counts == [320, 384]
    with pytest.raises(psidpd.InputError):
        psidpd.sweep(tmp_path / "scene.toml", {"densty": [5.0]}, tmp_path / "other")


def test_other_integrators_are_those_of_a_run():
    """Trial moves before and after time steps, whose length the first stage tunes, and a thermostat at every third step."""
    stages = [
        {"name": "rest", "steps": 6, "integrator": "monte-carlo", "kT": 1.5},
        {"name": "slow", "steps": 7, "dt": 0.02, "integrator": "aboba", "thermostat_every": 3, "kT": 0.7},
        {"name": "moves", "steps": 4, "integrator": "monte-carlo", "sweeps": 2, "kT": 0.7},
        {"name": "last", "steps": 5, "dt": 0.03, "integrator": "aboba"},
    ]
    scene = {**SCENE, "stage": stages, "output": {"thermo": 1}}
    result = psidpd.run(scene)
    assert result.summary["steps"] == 22
    for piece in (1, 5, 22):
        simulation = psidpd.Simulation(scene)
        seen = []
        while simulation.step < 22:
            simulation.run(min(piece, 22 - simulation.step))
            seen.append((simulation.step, simulation.stage, simulation.time))
        # A step of trial moves counts as a time of 1.
        ends = {6: ("rest", 6.0), 13: ("slow", 6.14), 17: ("moves", 10.14), 22: ("last", 10.29)}
        for step, stage, at in seen:
            if step in ends:
                assert (stage, at) == (ends[step][0], pytest.approx(ends[step][1], abs=1e-12))
        assert simulation.time == pytest.approx(result.thermo["time"].iloc[-1], abs=1e-12)
        assert numpy.array_equal(simulation.positions, result.positions)
        last = result.thermo.iloc[-1]
        assert simulation.temperature == last["temperature"] and simulation.pressure[0] == last["pxx"]
        assert simulation.potential_energy == pytest.approx(last["potential"], rel=1e-12)


def test_a_leaning_box_of_two_species_is_told_as_it_is(tmp_path):
    """Edges are rows; energies follow from masses, velocities and types, which follow the tags: every fourth is of the other
    species and three times as heavy."""
    edges = numpy.array([[4.0, 0.0, 0.0], [1.0, 5.0, 0.0], [-0.5, 0.75, 6.0]])
    grid = numpy.stack(numpy.meshgrid(*[numpy.arange(n) for n in (6, 7, 8)], indexing="ij"), -1).reshape(-1, 3)
    places = (grid + 0.5) / (6, 7, 8) @ edges
    rows = [f"{k + 1} {2 if k % 4 == 0 else 1} {x} {y} {z}" for k, (x, y, z) in enumerate(places.tolist())]
    head = "a box that leans\n\n336 atoms\n2 atom types\n\n0 4 xlo xhi\n0 5 ylo yhi\n0 6 zlo zhi\n1 -0.5 0.75 xy xz yz\n"
    (tmp_path / "start.data").write_text(head + "\nMasses\n\n1 1.0\n2 3.0\n\nAtoms # atomic\n\n" + "\n".join(rows) + "\n")
    scene = {
        "model": MODELS / "huggins.toml",
        "kT": 0.7,
        "initial": {"kind": "data", "file": "start.data", "velocities": "thermal"},
        "seed": 3,
        "dt": 0.005,
        "steps": 8,
    }
    simulation = psidpd.Simulation(scene, base=tmp_path)
    assert numpy.allclose(simulation.positions, places, atol=1e-8)
    simulation.run(5)
    assert simulation._steps.left == 3 and simulation.kT == 0.7 and simulation.time == pytest.approx(0.025)
    assert numpy.array_equal(simulation.box, edges) and simulation.species == ["A", "B"]
    assert [kind == 1 for kind in simulation.types] == [k % 4 == 0 for k in range(336)]
    mass = numpy.array([1.0, 3.0])[simulation.types]
    kinetic = 0.5 * (mass * (simulation.velocities**2).sum(axis=1)).sum()
    assert simulation.kinetic_energy == pytest.approx(kinetic, rel=1e-12)
    # Momentum is conserved along three directions.
    assert simulation.temperature == pytest.approx(2 * kinetic / (3 * 335), rel=1e-12)
