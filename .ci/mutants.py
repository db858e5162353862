"""The work of `.ci/mutants`: copies the sources, draws changes, tries them with the tests beside them, and prints what survives."""

import collections
import json
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import time

MINUTES = 30
ROOT = pathlib.Path.cwd()
WORK = ROOT / "target" / "mutants"
COPY = WORK / "psidpd"

# What is changed, and which tests of the crate try it: names that are run, then names that are left out, as they take long.
GROUPS = {
    "experiments/src/pareto": (["pareto"], []),
    "experiments/src/check": (["check"], []),
    "experiments/src/calibrate": (["calibrate"], []),
    "experiments/src/liquid": (["liquid"], []),
    "experiments/src/mixture": (["mixture", "slabs", "seek"], []),
    "experiments/src/wall": (["wall", "slabs", "seek"], []),
    "experiments/src/hardcases": (["hardcases"], []),
    "report/src/run/headline.rs": (["headline"], []),
    "dynamics/src/run/watch.rs": (["watch"], ["small_slabs"]),
    "dynamics/src/run/advice.rs": (["advice"], []),
    "observe/src/meter": ([], []),
    "observe/src/series.rs": ([], []),
    "observe/src/statistics.rs": ([], []),
}
# Ways to write a text or a debug form have no right answer.
WORDS = ["impl (std::fmt::|fmt::)?(Display|Debug)", "-> String with"]
ENVIRONMENT = {"CARGO_TARGET_DIR": str(WORK / "target"), "RUSTFLAGS": "-Awarnings"}


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


def compile_once(package):
    """What no change touches; the first time this takes a quarter of an hour."""
    command = ["cargo", "test", "--release", "--lib", "--no-run", "--quiet", "--package", package]
    subprocess.run(command, check=True, cwd=COPY, env=os.environ | ENVIRONMENT)


def mutants(*arguments, timeout=None):
    command = ["cargo", "mutants", "--dir", str(COPY), "--config", str(ROOT / ".ci" / "mutants.toml"), *arguments]
    with subprocess.Popen(command, env=os.environ | ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as run:
        try:
            said = run.communicate(timeout=timeout)[0]
        except subprocess.TimeoutExpired:
            run.send_signal(subprocess.signal.SIGINT)
            return run.communicate()[0], 124
        return said, run.returncode


def listed():
    """All changes, by group."""
    of = [word for group in GROUPS for word in ("--file", f"validation/{group}" + ("" if group.endswith(".rs") else "/**"))]
    of += [f"--exclude-re={words}" for words in WORDS]
    said, code = mutants("--list", "--json", "--workspace", *of)
    if code:
        sys.exit(said)
    names = sorted(one["name"] for one in json.loads(said[said.index("[") :]))
    return [name for name in names if "/tests" not in name.split(":")[0]]


def group_of(name):
    return next(group for group in GROUPS if name.startswith(f"validation/{group}"))


def package_of(group):
    return "psidpd-" + group.split("/")[0]


def main(seed, most):
    copy()
    names = listed()
    by_group = collections.defaultdict(list)
    for name in names:
        by_group[group_of(name)].append(name)
    # As many of each instrument.
    for group, all_of in by_group.items():
        by_group[group] = random.Random(f"{seed} {group}").sample(all_of, min(max(1, most // len(GROUPS)), len(all_of)))
    drawn = sum(len(chosen) for chosen in by_group.values())
    print(f"{drawn} of {len(names)} changes", file=sys.stderr, flush=True)
    for package in sorted({package_of(group) for group in by_group}):
        compile_once(package)
    begin = time.monotonic()
    found = collections.defaultdict(list)
    groups = [group for group in GROUPS if by_group[group]]
    for number, group in enumerate(groups):
        out = WORK / "out"
        shutil.rmtree(out, ignore_errors=True)
        run, without = GROUPS[group]
        tests = [*run, "--", *(word for name in without for word in ("--skip", name))]
        choice = ["--re=^" + re.sub(r"([^\w ])", r"\\\1", name) + "$" for name in by_group[group]]
        # An even share of the time that is left.
        left = max(1.0, 60 * MINUTES - (time.monotonic() - begin)) / (len(groups) - number)
        settings = ["--in-place", "--profile", "release", "--timeout", "120", "--baseline", "skip", "--no-times", "--output", str(out)]
        said, code = mutants(
            *settings, "--package", package_of(group), *choice, "--cargo-arg=--lib", *(f"--cargo-test-arg={word}" for word in tests), timeout=left
        )
        if code not in (0, 2, 3, 124):
            sys.exit(said)
        for kind in ("caught", "missed", "timeout", "unviable"):
            path = out / "mutants.out" / f"{kind}.txt"
            found[kind] += path.read_text().splitlines() if path.exists() else []
    by_file = collections.defaultdict(list)
    for line in found["missed"]:
        by_file[line.split(":")[0]].append(line.split(":", 1)[1])
    for name in sorted(by_file):
        print(name, *("  " + line for line in by_file[name]), sep="\n")
    caught, missed = len(found["caught"]) + len(found["timeout"]), len(found["missed"])
    share = f", {100 * missed / (caught + missed):.0f} %" if caught + missed else ""
    tried = caught + missed + len(found["unviable"])
    rest = f"; {drawn - tried} were not tried in {MINUTES} minutes" if tried < drawn else ""
    print(f"{missed} of {caught + missed} survive{share}; {len(found['unviable'])} do not compile{rest}")


main(int(sys.argv[1]), int(sys.argv[2]))
