#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Which of many hand poses reach an object of a scene without hitting anything, and how much room each leaves.

    plan_with_collisions.py [SCENE]
"""

import sys
from typing import List, Tuple

import numpy as np

import prescene
from prescene.collision import Mesh


def box(size: Tuple[float, float, float]) -> Mesh:
    """A closed box about the origin; faces counter-clockwise seen from outside."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size
    faces = [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]  # fmt: skip
    return Mesh(corners, faces, "hand")


def main(path: str) -> None:
    scene = prescene.load_scene(path)
    target = scene.objects[0]
    hand = box((0.02, 0.02, 0.12))

    obstacles: List[Tuple[Mesh, np.ndarray]] = []
    for support in scene.supports:
        shape = support.collision_mesh()
        obstacles.append((Mesh(shape.vertices, shape.faces, support.name), support.X_WS))
    shape = target.model.collision_mesh()
    obstacles.append((Mesh(shape.vertices, shape.faces, target.name), target.X_WO))

    # The hand upright on a grid about the object, a little above it.
    top = (target.X_WO[:3, :3] @ shape.vertices.T)[2].max() + target.X_WO[2, 3]
    steps = np.linspace(-0.15, 0.15, 31)
    X_WH = np.tile(np.eye(4), (steps.size, steps.size, 1, 1))
    X_WH[..., 0, 3] = target.X_WO[0, 3] + steps[:, None]
    X_WH[..., 1, 3] = target.X_WO[1, 3] + steps[None, :]
    X_WH[..., 2, 3] = top + 0.061 - 0.03 * (np.abs(steps)[:, None] > 0.06)
    X_WH = X_WH.reshape(-1, 4, 4)

    room = np.full(len(X_WH), np.inf)
    for mesh, X_WM in obstacles:
        X_MH = np.linalg.inv(X_WM) @ X_WH
        room = np.minimum(room, mesh.distance(hand, X_MH, limit=0.2))
    print(f"{(room > 0).sum()} of {len(room)} poses touch nothing; the tightest of them leaves {1e3 * room[room > 0].min():.1f} mm")

    # What a range finder beside the object would see of it.
    mesh, X_WM = obstacles[-1]
    directions = np.stack([np.cos(np.linspace(0, 2 * np.pi, 360)), np.sin(np.linspace(0, 2 * np.pi, 360)), np.zeros(360)], axis=1)
    origin = np.linalg.inv(X_WM) @ [target.X_WO[0, 3] - 0.5, target.X_WO[1, 3], target.X_WO[2, 3], 1.0]
    hits = mesh.cast_rays(origin[None, :3], directions @ X_WM[:3, :3])
    print(f"{np.isfinite(hits.t).sum()} of 360 rays meet {mesh.name}, the nearest after {hits.t.min():.3f} m")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "/usr/share/prescene/scenarios/milk_on_bin.yaml")
