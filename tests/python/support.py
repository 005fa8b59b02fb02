# SPDX-License-Identifier: Apache-2.0
"""What the tests of the Python package share."""

import json
import os
import pathlib
import subprocess
from typing import Any, Dict, List

SOURCE = pathlib.Path(os.environ["PRESCENE_SOURCE_DIR"])
SCENARIOS = SOURCE / "scenarios"
PROGRAM = os.environ["PRESCENE_PROGRAM"]

# A box that lies on a table, pushed off its edge or not: quick to simulate and to record.
PUSHED_BOX = """
name: pushed_box
duration: 1.5
models:
  box:
    box: [0.08, 0.06, 0.05]
    mass: {normal: [0.4, 0.05], min: 0.1}
    friction: {uniform: [0.2, 0.7]}
    restitution: 0.1
supports:
  table:
    box: [0.6, 0.6, 0.04]
    pose: {position: [0, 0, -0.02]}
    friction: 0.8
objects:
  parcel:
    model: box
    pose:
      position: [0.1, 0.0, 0.025]
      normal: {position: [0.01, 0.01, 0], rotation_deg: [0, 0, 5]}
camera:
  width: 160
  height: 120
  fov_deg: 55
  look: {from: [0.5, -0.5, 0.5], at: [0.1, 0, 0]}
actions:
  - time: 0.2
    push: {from: [-0.05, 0.0, 0.02], to: [0.2, 0.0, 0.02], duration: 0.6, radius: 0.015}
exclusive_outcomes:
  where:
    object: parcel
    outcomes:
      on_table: {resting_on: table}
outcomes:
  moved: {object: parcel, moved_more_than: 0.05}
"""


def run_program(*arguments: str) -> "subprocess.CompletedProcess[str]":
    if not os.path.exists(PROGRAM):
        raise FileNotFoundError(f"there is no program {PROGRAM} to compare with: ./dev build release prescene, or set PRESCENE_PROGRAM")
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False)


def program_json(*arguments: str) -> Dict[str, Any]:
    done = run_program(*arguments, "--json", "--quiet")
    assert done.returncode == 0, done.stderr
    document: Dict[str, Any] = json.loads(done.stdout)
    return document


def without_times(document: Dict[str, Any]) -> Dict[str, Any]:
    return {key: value for key, value in document.items() if key not in ("wall_seconds", "cpu_seconds")}


def write_scene(folder: pathlib.Path) -> pathlib.Path:
    path = folder / "pushed_box.yaml"
    path.write_text(PUSHED_BOX)
    return path


def make_recording(folder: pathlib.Path) -> pathlib.Path:
    """A simulated recording of the pushed box."""
    recording = folder / "pushed_box.mcap"
    done = run_program("record", "--simulate", str(write_scene(folder)), "-o", str(recording), "--seed", "3", "--quiet")
    assert done.returncode == 0, done.stderr
    return recording


def box(size: float = 1.0) -> "tuple[List[List[float]], List[List[int]]]":
    """Vertices and faces of a cube about the origin, counter-clockwise seen from outside."""
    h = size / 2
    corners = [[x, y, z] for x in (-h, h) for y in (-h, h) for z in (-h, h)]
    faces = [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]  # fmt: skip
    return corners, faces
