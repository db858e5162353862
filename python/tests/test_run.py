import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy
import psidpd
import pytest
from conftest import MODELS, scene

OBSERVE = "[observe]\nevery = 5\ntemperature = true\nrdf = true\n"


def test_a_run_is_that_of_the_command_line(tmp_path):
    (tmp_path / "scene.toml").write_text(scene(observe=OBSERVE))
    result = psidpd.run(tmp_path / "scene.toml", out=tmp_path / "python", threads=2)
    command = [sys.executable, "-m", "psidpd", "run", "scene.toml", "--out", "shell"]
    subprocess.run(command, cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)
    for name in ("thermo.csv", "final.data", "observables.json"):
        assert (tmp_path / "python" / name).read_bytes() == (tmp_path / "shell" / name).read_bytes()
    # What the command prints at its end, and its notes: so short a run has some.
    command = [sys.executable, "-m", "psidpd", "--json", "said.json", "run", "scene.toml", "--out", "again"]
    subprocess.run(command, cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)
    said = json.loads((tmp_path / "said.json").read_text())["headline"]
    headline = result.headline
    assert list(headline.index) == [v["name"] for v in said["values"]] and "temperature" in headline.index
    assert list(headline["value"]) == [v["value"] for v in said["values"]]
    assert list(headline["unit"]) == [v["unit"] for v in said["values"]]
    assert headline.attrs["notes"] == said["notes"] and said["notes"]
    thermo = result.thermo
    assert list(thermo["step"]) == list(range(0, 61, 5)) and thermo.attrs["units"]["pressure"]
    assert result.summary["steps"] == 60


def test_numbers_have_errors():
    result = psidpd.run(scene(400, OBSERVE).replace("steps", "equilibrate = 300\nsteps"))
    rdf = result.observables["rdf"]
    assert len(rdf) > 10 and rdf.attrs["kind"] == "curve"
    assert [c for c in rdf if c.endswith("_error")] and list(rdf)[0] in rdf.attrs["units"]
    value, error = result.value("temperature.kinetic")
    assert abs(value - 1.0) < 0.1 and 0.0 < error < 0.1
    value, error = result.value("pressure")
    rows = result.thermo
    last = rows[rows["step"] > 300]["pressure"]
    assert value == pytest.approx(last.mean()) and error > 0.5 * last.std() / numpy.sqrt(len(last))
    assert list(result.means.columns) == ["value", "error"]
    with pytest.raises(KeyError, match="temperature.kinetic"):
        result.value("temprature")


def test_the_folder_of_a_run_without_one_goes_with_it():
    result = psidpd.run(scene(5))
    folder = result.folder
    assert (folder / "final.data").is_file()
    del result
    assert not folder.exists()


def test_a_model_beside_the_text_is_found(tmp_path):
    (tmp_path / "m.toml").write_text((MODELS / "standard-dpd.toml").read_text())
    text = 'model = "m.toml"\nkT = 1.0\nbox = 4.0\ndensity = 3.0\nsteps = 2\n'
    assert psidpd.run(text, base=tmp_path).summary["particles"] == 192
    with pytest.raises(psidpd.InputError, match="m.toml"):
        psidpd.run(text, base=tmp_path / "elsewhere")


def test_errors_are_those_of_the_command_line(tmp_path):
    text = scene().replace("steps", "stepps")
    (tmp_path / "scene.toml").write_text(text)
    command = [sys.executable, "-m", "psidpd", "run", tmp_path / "scene.toml", "--out", tmp_path / "out"]
    shell = subprocess.run(command, capture_output=True, text=True)
    assert shell.returncode == 2
    with pytest.raises(psidpd.InputError) as raised:
        psidpd.run(tmp_path / "scene.toml", out=tmp_path / "out")
    assert shell.stderr.strip() == "error: " + str(raised.value).strip()
    with pytest.raises(psidpd.InputError, match="no about.json"):
        psidpd.Result(tmp_path)
    with pytest.raises(psidpd.InputError, match="exclude"):
        psidpd.run(text, out=tmp_path / "out", resume=True, overwrite=True)


def test_a_gpu_is_refused_by_name_in_a_package_without_them(tmp_path):
    with pytest.raises(psidpd.InputError, match="PSIDPD_WITH_GPU=1"):
        psidpd.run(scene(2), out=tmp_path / "out", device="gpu")
    with pytest.raises(psidpd.InputError, match="PSIDPD_WITH_GPU=1"):
        psidpd.Simulation(scene(2).replace("steps", 'device = "gpu:1"\nsteps'))
    with pytest.raises(psidpd.InputError, match="cpu, gpu, gpu:N"):
        psidpd.run(scene(2), device="cuda")
    psidpd.run(scene(2), out=tmp_path / "out", device="cpu")


def test_advice_is_for_python(tmp_path):
    psidpd.run(scene(2), out=tmp_path / "out")
    with pytest.raises(psidpd.InputError, match="overwrite=True") as raised:
        psidpd.run(scene(3), out=tmp_path / "out")
    assert "--overwrite" not in str(raised.value)


def test_a_run_that_stops_says_where(tmp_path):
    hot = scene(500).replace("steps = 500", "steps = 500\ndt = 0.5")
    with pytest.raises(psidpd.RunStoppedError, match="step"):
        psidpd.run(hot, out=tmp_path / "hot")
    assert (tmp_path / "hot" / "last-good.data").is_file()


def test_other_threads_go_on_during_a_run():
    ticks = []
    done = threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.005)

    clock = threading.Thread(target=tick)
    clock.start()
    begin = time.monotonic()
    psidpd.run(scene(1500))
    took = time.monotonic() - begin
    done.set()
    clock.join()
    # With the lock held there would be none between the first and the last.
    assert len([t for t in ticks if begin + 0.1 * took < t < begin + 0.9 * took]) > 5


def test_ctrl_c_ends_a_run_that_can_be_resumed(tmp_path):
    text = scene(1_000_000)
    program = (
        "import psidpd, sys\n"
        "try:\n"
        f"    psidpd.run({text!r}, out='out')\n"
        "except KeyboardInterrupt as stop:\n"
        "    print(stop)\n"
        "    sys.exit(7)\n"
    )
    run = subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        text=True,
        # In the background of a script, programs are started deaf to it.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    thermo = tmp_path / "out" / "thermo.csv"
    while not (thermo.is_file() and len(thermo.read_text().splitlines()) > 3):
        assert run.poll() is None
        time.sleep(0.05)
    os.kill(run.pid, signal.SIGINT)
    said, _ = run.communicate(timeout=30)
    assert run.returncode == 7 and "resume=True" in said, said
    assert (tmp_path / "out" / "checkpoint").is_file()


def test_a_stopped_run_goes_on(tmp_path):
    text = scene(40)
    whole = psidpd.run(text, out=tmp_path / "whole")
    assert psidpd.run(text, out=tmp_path / "whole", resume=True).summary == whole.summary


def test_the_program_answers_and_exits(tmp_path):
    def program(*words):
        return subprocess.run([sys.executable, "-m", "psidpd", *words], cwd=tmp_path, capture_output=True, text=True)

    assert program("--version").stdout.split() == ["psidpd", psidpd.__version__]
    assert program("nonsense").returncode == 2
    model = MODELS / "warren2003-set6.toml"
    assert program("check", model, "--density", "6.05", "--json", "c.json").returncode in (0, 1)
    assert json.loads((tmp_path / "c.json").read_text())["kt"] == 1.0


def test_estimates_count_correlation():
    random = numpy.random.default_rng(1)
    noise = random.normal(size=4096)
    mean, error = psidpd.estimate(noise)
    assert abs(mean) < 5 * error and error == pytest.approx(1 / 64, rel=0.2)
    correlated = numpy.convolve(noise, numpy.ones(16), "valid")
    _, larger = psidpd.estimate(correlated)
    assert larger > 3 * correlated.std() / 64
    assert numpy.isnan(psidpd.estimate([1.0, 2.0])[1])
