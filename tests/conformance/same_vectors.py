#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""same_vectors.py GENERATED STORED: whether the generator still writes the vectors that are stored.

Exit status 0: byte for byte; 1: not; 77: not to be expected, as the libraries are others."""

import json
import pathlib
import sys

generated, stored = (pathlib.Path(path) for path in sys.argv[1:3])
names = sorted({p.name for p in generated.iterdir()} | {p.name for p in stored.iterdir()} - {"LICENSE"})
different = []
for name in names:
    files = [folder / name for folder in (generated, stored)]
    if not all(f.exists() for f in files):
        different.append(f"{name} is only in {next(f.parent for f in files if f.exists())}")
    elif files[0].read_bytes() != files[1].read_bytes():
        different.append(f"{name} differs")
print(f"{len(names) - len(different)} of {len(names)} files are the same")
if not different:
    sys.exit(0)
print("\n".join(different))
tools = [json.loads((folder / "TOOLS.json").read_text()) for folder in (generated, stored)]
if tools[0] != tools[1]:
    print(f"skipped: these libraries, {tools[0]}, are not those of the stored vectors, {tools[1]}")
    sys.exit(77)
sys.exit(1)
