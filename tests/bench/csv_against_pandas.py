#!/usr/bin/env python3
"""Native CSV reading beside the C engine of pandas, on the same file in the same run.

Installs pandas into a virtual environment of its own below the build folder, writes a file of 360,000 rows and 20
columns, builds the example `csv_speed` and lets both read it in turn, in many short rounds, each in a process that stays:
first both bound to one core, then both with every core (pandas 3 parses in two threads); at last each round in a process
of its own, as a log is opened, the time to start it left out. Clocks of a virtual machine jump both ways and other work
steals time: the median, the least, and the least processor time of all rounds are printed. `--check RATIO` ends with status
1 if the ratio of the least times is lower with one core or in processes of their own.
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


class Reader:
    """A process that reads the file once a line it is sent, and answers seconds, processor seconds and rows."""

    def __init__(self, command, core):
        self.command, self.core, self.rounds = command, core, []
        self.start()

    def start(self):
        bind = (lambda: os.sched_setaffinity(0, {self.core})) if self.core is not None else None
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen(self.command, preexec_fn=bind, **pipes)

    def read(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        seconds, processor, rows = self.process.stdout.readline().split()[:3]
        assert int(rows) == ROWS, rows
        self.rounds.append((float(seconds), float(processor)))

    def stop(self):
        self.process.stdin.close()
        self.process.wait()

    def end(self):
        """Median and least seconds, and least processor seconds."""
        self.stop()
        seconds = [s for s, _ in self.rounds]
        return statistics.median(seconds), min(seconds), min(p for _, p in self.rounds)


def compare(case, pandas, ours, path, rounds, anew=False):
    """Print one line each; the ratio of the least times. `anew`: each round in a process of its own."""
    for _ in range(rounds):
        for reader in (pandas, ours):
            if anew:
                reader.stop()
                reader.start()
            reader.read()
    size = path.stat().st_size / 1e6
    reference = pandas.end()
    for name, found in (("pandas", reference), ("ours", ours.end())):
        ratios = [a / b for a, b in zip(reference, found)]
        print(
            f"{size:.1f} MB, {case}, {name}: median {size / found[0]:.0f} MB/s (ratio {ratios[0]:.2f}), "
            f"best {size / found[1]:.0f} MB/s (ratio {ratios[1]:.2f}), processor time {found[2]:.3f} s ({ratios[2]:.2f})"
        )
    return ratios[1]


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
    build = ["cargo", "build", "--release", "-p", "drivescope-cli", "--example", "csv_speed"]
    subprocess.run(build, check=True, cwd=ROOT)
    native = [TARGET / "release" / "examples" / "csv_speed", path]
    first = min(os.sched_getaffinity(0))
    cases = (("one core", first, ["1"], False), ("all cores", None, [], False), ("all cores, anew", None, [], True))
    ratios = {}
    for case, core, threads, anew in cases:
        pair = Reader([python, "-c", PANDAS, path], core), Reader(native + threads, core)
        ratios[case] = compare(case, *pair, path, args.rounds, anew)
    ratios.pop("all cores")
    return 0 if args.check is None or min(ratios.values()) >= args.check else 1


if __name__ == "__main__":
    sys.exit(main())
