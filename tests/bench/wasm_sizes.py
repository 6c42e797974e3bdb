#!/usr/bin/env python3
"""Code size of every format's reader in WebAssembly: builds the example `linked` and adds up its functions by module."""

import collections
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
WASM = TARGET / "wasm32-unknown-unknown" / "release" / "examples" / "linked.wasm"
# Crates whose functions count under their own names, and modules of the reader beside the formats.
MODULES = {p.stem for p in (ROOT / "crates/import/src/formats").iterdir()}
OTHERS = ["miniz_oxide", "flate2", "ruzstd", "serde_json", "drivescope_drive"]


def number(data, at):
    value, shift = 0, 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            return value, at


def text(data, at):
    length, at = number(data, at)
    return data[at : at + length].decode("utf-8", "replace"), at + length


def functions(data):
    """Name and bytes of every function."""
    sizes, names, imported, at = [], {}, 0, 8
    while at < len(data):
        kind, at = data[at], at + 1
        length, at = number(data, at)
        end, here = at + length, at
        if kind == 2:
            count, here = number(data, here)
            for _ in range(count):
                _, here = text(data, here)
                _, here = text(data, here)
                which, here = data[here], here + 1
                assert which == 0, "only functions are imported"
                imported += 1
                _, here = number(data, here)
        elif kind == 10:
            count, here = number(data, here)
            for _ in range(count):
                size, here = number(data, here)
                sizes.append(size)
                here += size
        elif kind == 0:
            name, here = text(data, here)
            while name == "name" and here < end:
                part, here = data[here], here + 1
                size, here = number(data, here)
                stop = here + size
                if part == 1:
                    count, here = number(data, here)
                    for _ in range(count):
                        index, here = number(data, here)
                        names[index], here = text(data, here)
                here = stop
        at = end
    return [(names.get(i + imported, ""), size) for i, size in enumerate(sizes)]


def owner(name):
    if "drivescope_import" in name and "formats" in name:
        tail = name.split("formats", 1)[1]
        sized = re.match(r"(\d+)(\w+)", tail)
        module = sized.group(2)[: int(sized.group(1))] if sized else re.match(r"(?:\.\.|::)?(\w*)", tail).group(1)
        return f"formats {module}" if module in MODULES else "formats (registry, detection)"
    for crate in OTHERS:
        if crate in name:
            return crate
    return "merging, mapping, CSV" if "drivescope_import" in name else "the rest (library, example)"


def main():
    command = ["cargo", "build", "--release", "--target", "wasm32-unknown-unknown"]
    subprocess.run([*command, "-p", "drivescope-import", "--example", "linked"], check=True, cwd=ROOT)
    total = collections.Counter()
    for name, size in functions(WASM.read_bytes()):
        total[owner(name)] += size
    for name, size in total.most_common():
        print(f"{size / 1000:8.1f} KB  {name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
