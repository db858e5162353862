"""The work of `.ci/mutants`: copies the sources, draws changes, tries them with the tests beside them, and prints what survives."""

import collections
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import time

MINUTES = 30
ROOT = pathlib.Path.cwd()
WORK = ROOT / "target" / "mutants"
COPY = WORK / "psidpd"

# What is changed, and which tests try it: crates, with names that are run, then names that are left out, as they take long.
# Meters sample particles in the tests of the crate that moves them.
METERS = ("dynamics", ["tests::known", "tests::meters", "tests::balance", "tests::carried", "tests::a_", "tests::profiles"], ["run::", "trial::", "scene::", "checkpoint::", "freezing::"])
GROUPS = {
    "experiments/src/pareto": [("experiments", ["pareto"], [])],
    "experiments/src/check": [("experiments", ["check"], [])],
    "experiments/src/calibrate": [("experiments", ["calibrate"], [])],
    "experiments/src/model/liquid": [("experiments", ["liquid"], [])],
    "experiments/src/model/mixture": [("experiments", ["mixture", "slabs", "seek"], [])],
    "experiments/src/model/wall": [("experiments", ["wall", "slabs", "seek"], [])],
    "experiments/src/hardcases": [("experiments", ["hardcases"], [])],
    "report/src/run/headline.rs": [("report", ["headline"], [])],
    "dynamics/src/run/watch.rs": [("dynamics", ["watch"], ["small_slabs"])],
    "dynamics/src/run/advice.rs": [("dynamics", ["advice"], [])],
    "observe/src/meter": [("observe", [], []), METERS],
    "observe/src/series.rs": [("observe", [], []), METERS],
    "observe/src/statistics.rs": [("observe", [], [])],
}
# Ways to write a text or a debug form have no right answer.
WORDS = ["impl (std::fmt::|fmt::)?(Display|Debug)", "-> String with"]
# What one line changes is compiled in four seconds in place of twenty.
ENVIRONMENT = {"CARGO_TARGET_DIR": str(WORK / "target"), "RUSTFLAGS": "-Awarnings", "CARGO_INCREMENTAL": "1"}


def copy():
    """Makes the copy like the checkout. Files that are the same keep their time, so that cargo compiles only what has changed."""
    listed = subprocess.run(["git", "ls-files", "-z"], check=True, capture_output=True, text=True).stdout
    names = [name for name in listed.split("\0") if name and (ROOT / name).is_file()]
    for old in COPY.rglob("*") if COPY.exists() else []:
        if old.is_file() and str(old.relative_to(COPY)) not in names:
            old.unlink()
    for name in names:
        to = COPY / name
        if not to.exists() or to.read_bytes() != (ROOT / name).read_bytes():
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, to)


def listed():
    """All changes, with what they do to which file."""
    command = ["cargo", "mutants", "--dir", str(COPY), "--config", str(ROOT / ".ci" / "mutants.toml"), "--list", "--json", "--workspace"]
    command += [word for group in GROUPS for word in ("--file", f"validation/{group}" + ("" if group.endswith(".rs") else "/**"))]
    command += [f"--exclude-re={words}" for words in WORDS]
    said = subprocess.run(command, env=os.environ | ENVIRONMENT, stdout=subprocess.PIPE, text=True, check=True).stdout
    changes = sorted(json.loads(said), key=lambda change: change["name"])
    return [change for change in changes if "/tests" not in change["file"]]


def group_of(change):
    return next(group for group in GROUPS if change["file"].startswith(f"validation/{group}"))


def cargo_test(crate, *arguments, timeout=None):
    """The exit status; `None` for a test that did not end."""
    command = ["cargo", "test", "--release", "--lib", "--quiet", "--package", f"psidpd-{crate}", *arguments]
    settings = {"cwd": COPY, "env": os.environ | ENVIRONMENT, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, start_new_session=True, **settings) as run:
        try:
            return run.wait(timeout)
        except subprocess.TimeoutExpired:
            # The test is a child of cargo.
            os.killpg(run.pid, signal.SIGKILL)
            return None


def passes(crate, run, without):
    """Whether the tests of a crate pass; one that does not end fails."""
    names = ["--", *run, *(word for name in without for word in ("--skip", name))]
    return cargo_test(crate, *names, timeout=120) == 0


def attempt(change):
    """What becomes of a change: it does not compile, a test catches it, or none does."""
    path = COPY / change["file"]
    before = path.read_bytes()
    # cargo-mutants can be told which changes to try by a pattern, but tries all that leave out a field of a struct beside them.
    subprocess.run(["patch", "--silent", "--no-backup-if-mismatch", str(path)], input=change["diff"], text=True, check=True)
    try:
        for crate, run, without in GROUPS[group_of(change)]:
            if cargo_test(crate, "--no-run") != 0:
                return "unviable"
            if not passes(crate, run, without):
                return "caught"
        return "missed"
    finally:
        path.write_bytes(before)


def main(seed, most):
    copy()
    changes = listed()
    by_group = collections.defaultdict(list)
    for change in changes:
        by_group[group_of(change)].append(change)
    # As many of each instrument, one of each in turn.
    drawn = []
    for group, all_of in by_group.items():
        chosen = random.Random(f"{seed} {group}").sample(all_of, min(max(1, most // len(GROUPS)), len(all_of)))
        drawn += [(number, group, change) for number, change in enumerate(chosen)]
    drawn.sort(key=lambda one: one[:2])
    print(f"{len(drawn)} of {len(changes)} changes", file=sys.stderr, flush=True)
    # What no change touches; the first time this takes a quarter of an hour.
    for crate in sorted({crate for group in by_group for crate, _, _ in GROUPS[group]}):
        if cargo_test(crate, "--no-run") != 0:
            sys.exit(f"{crate} does not compile without a change")
    for group in sorted(by_group):
        if not all(passes(*tests) for tests in GROUPS[group]):
            sys.exit(f"{group}: its tests fail without a change")
    begin = time.monotonic()
    found = collections.Counter()
    by_file = collections.defaultdict(list)
    for _, _, change in drawn:
        if time.monotonic() - begin > 60 * MINUTES:
            break
        outcome = attempt(change)
        found[outcome] += 1
        print(f"{outcome} {change['name']}", file=sys.stderr, flush=True)
        if outcome == "missed":
            by_file[change["file"]].append(change["name"].split(":", 1)[1])
    for name in sorted(by_file):
        print(name, *("  " + line for line in by_file[name]), sep="\n")
    judged = found["caught"] + found["missed"]
    share = f", {100 * found['missed'] / judged:.0f} %" if judged else ""
    rest = len(drawn) - found.total()
    not_tried = f"; {rest} were not tried in {MINUTES} minutes" if rest else ""
    print(f"{found['missed']} of {judged} survive{share}; {found['unviable']} do not compile{not_tried}")


main(int(sys.argv[1]), int(sys.argv[2]))
