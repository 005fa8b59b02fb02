# SPDX-License-Identifier: Apache-2.0
"""Runs an example with what it takes: run_example.py EXAMPLE. Fails where it does, or where it prints nothing."""

import pathlib
import subprocess
import sys
import tempfile

import support

example = pathlib.Path(sys.argv[1])
with tempfile.TemporaryDirectory() as folder:
    if example.stem == "track_recording":
        argument = str(support.make_recording(pathlib.Path(folder)))
    else:
        argument = str(support.SCENARIOS / "milk_on_bin.yaml")
    done = subprocess.run([sys.executable, "-W", "error", str(example), argument], stdout=subprocess.PIPE, text=True, check=False)
    print(done.stdout)
    if done.returncode != 0 or not done.stdout.strip():
        sys.exit(f"{example.name} ended with {done.returncode}")
