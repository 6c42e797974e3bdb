#!/usr/bin/env python3
"""Native CSV reading beside the C engine of pandas, on the same file in the same run.

Installs pandas into a virtual environment of its own below the build folder, writes a file of 360,000 rows and 20
columns, builds the example `csv_speed` and lets both read it in turn. The median of all rounds counts: clocks of a
virtual machine jump both ways. `--check RATIO` ends with status 1 if the ratio is lower.
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
for _ in range(int(sys.argv[2])):
    begin = time.perf_counter()
    frame = pandas.read_csv(sys.argv[1], engine="c")
    took = time.perf_counter() - begin
    print(took, len(frame))
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


def seconds(command):
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split("\n")
    rounds = [line.split() for line in lines if line]
    assert all(int(r[1]) == ROWS for r in rounds), rounds
    return [float(r[0]) for r in rounds]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=6)
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
    ours, theirs = [], []
    for _ in range(args.rounds):
        ours += seconds([TARGET / "release" / "examples" / "csv_speed", path, "2"])
        theirs += seconds([python, "-c", PANDAS, path, "2"])
    size = path.stat().st_size / 1e6
    ours, theirs = statistics.median(ours), statistics.median(theirs)
    ratio = theirs / ours
    print(f"{size:.1f} MB: drivescope {size / ours:.0f} MB/s, pandas {size / theirs:.0f} MB/s, ratio {ratio:.2f}")
    return 0 if args.check is None or ratio >= args.check else 1


if __name__ == "__main__":
    sys.exit(main())
