#!/usr/bin/env python3
"""Native CSV reading beside the C engine of pandas, on the same file in the same run.

Installs pandas into a virtual environment of its own below the build folder, writes a file of 360,000 rows and 20
columns, builds the example `csv_speed` and lets pandas, one thread of ours and all threads of ours read it in turn, in
many short rounds. Clocks of a virtual machine jump both ways and other work steals time: the median, the least, and the
least processor time of all rounds are printed. `--check RATIO` ends with status 1 if the ratio of the least times is lower.
"""

import argparse
import os
import random
import statistics
import subprocess
import sys
import venv
from pathlib import Path

ROWS, COLUMNS = 360_000, 20
ROOT = Path(__file__).resolve().parents[2]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
PANDAS = """
import sys, time, pandas
for line in sys.stdin:
    begin, cpu = time.perf_counter(), time.process_time()
    frame = pandas.read_csv(sys.argv[1], engine="c")
    print(time.perf_counter() - begin, time.process_time() - cpu, len(frame), flush=True)
"""


def write(path):
    """A log as drives have it: time, then noise of three sizes and a counter."""
    random.seed(1)
    with path.open("w") as out:
        out.write("t," + ",".join(f"c{i}" for i in range(1, COLUMNS)) + "\n")
        for row in range(ROWS):
            cells = [f"{random.gauss(0, 10 ** (i % 3)):.{5 - i % 3 // 2}f}" for i in range(1, COLUMNS)]
            out.write(f"{row / 100:.2f}," + ",".join(cells) + "\n")


def python_with_pandas(folder):
    python = folder / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
    if subprocess.run([python, "-c", "import pandas"], stderr=subprocess.DEVNULL).returncode:
        subprocess.run([python, "-m", "pip", "install", "--quiet", "pandas"], check=True)
    return python


def ours(path, threads):
    """Seconds, and seconds of processor time, of one reading in a process of its own."""
    before = os.times()
    command = [TARGET / "release" / "examples" / "csv_speed", path, "1"] + ([str(threads)] if threads else [])
    fields = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    after = os.times()
    assert int(fields[1]) == ROWS, fields
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    return float(fields[0]), cpu


def theirs(pandas):
    pandas.stdin.write("\n")
    pandas.stdin.flush()
    fields = pandas.stdout.readline().split()
    assert int(fields[2]) == ROWS, fields
    return float(fields[0]), float(fields[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--check", type=float)
    args = parser.parse_args()
    work = TARGET / "csv-against-pandas"
    work.mkdir(parents=True, exist_ok=True)
    path = work / "speed.csv"
    if not path.exists():
        write(path)
    python = python_with_pandas(work / "venv")
    build = ["cargo", "build", "--release", "-p", "drivescope-import", "--example", "csv_speed"]
    subprocess.run(build, check=True, cwd=ROOT)
    rounds = {"pandas": [], "one thread": [], "all threads": []}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen([python, "-c", PANDAS, path], **pipes) as pandas:
        for _ in range(args.rounds):
            rounds["pandas"].append(theirs(pandas))
            rounds["one thread"].append(ours(path, 1))
            rounds["all threads"].append(ours(path, None))
        pandas.stdin.close()
    size = path.stat().st_size / 1e6
    numbers = {}
    for name, times in rounds.items():
        wall, cpu = [t for t, _ in times], min(c for _, c in times)
        numbers[name] = (statistics.median(wall), min(wall), cpu)
    for name, found in numbers.items():
        ratios = [reference / value for reference, value in zip(numbers["pandas"], found)]
        print(
            f"{size:.1f} MB, {name}: median {size / found[0]:.0f} MB/s (ratio {ratios[0]:.2f}), "
            f"best {size / found[1]:.0f} MB/s (ratio {ratios[1]:.2f}), processor time {found[2]:.3f} s ({ratios[2]:.2f})"
        )
    ratio = numbers["pandas"][1] / numbers["all threads"][1]
    return 0 if args.check is None or ratio >= args.check else 1


if __name__ == "__main__":
    sys.exit(main())
