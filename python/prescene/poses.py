# SPDX-License-Identifier: Apache-2.0
"""Poses in two forms: a homogeneous matrix, and what scene files, questions and answers hold."""

from __future__ import annotations

import math
from typing import Any, Dict, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError

__all__ = ["matrix", "pose"]

_LARGEST_ERROR = 1e-3  # of a rotation's columns, as everywhere in prescene


def matrix(pose: Mapping[str, Any]) -> NDArray[np.float64]:
    """The homogeneous matrix (4, 4) of a pose as answers have them.

    `pose` has "position" [x, y, z] in metres and "rotation" {"quaternion_wxyz": [w, x, y, z]}; either may be missing.
    """
    try:
        position = np.asarray(pose.get("position", (0.0, 0.0, 0.0)), dtype=np.float64)
        quaternion = np.asarray(pose.get("rotation", {}).get("quaternion_wxyz", (1.0, 0.0, 0.0, 0.0)), dtype=np.float64)
    except (AttributeError, TypeError, ValueError):
        raise InputError(f"pose: {pose!r} is none: give position and rotation with quaternion_wxyz") from None
    norm = float(np.linalg.norm(quaternion)) if quaternion.shape == (4,) else 0.0
    if position.shape != (3,) or not np.isfinite(position).all() or not (0.0 < norm < math.inf):
        raise InputError(f"pose: {pose!r} is none: give three and four finite numbers")
    w, x, y, z = quaternion / norm
    result = np.eye(4)
    result[:3, 3] = position
    result[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return result


def pose(matrix: ArrayLike) -> Dict[str, Any]:
    """The pose of a homogeneous matrix (4, 4) as questions take it.

    The rotation may be off by 1e-3. Raises InputError for what is no pose.
    """
    X = np.asarray(matrix)
    if X.dtype.kind not in "fiu":
        raise InputError(f"matrix: an array of real numbers of shape (4, 4) is needed, not of dtype {X.dtype}")
    X = X.astype(np.float64)
    if X.shape != (4, 4) or not np.isfinite(X).all():
        raise InputError(f"matrix: finite numbers of shape (4, 4) are needed, this has shape {X.shape}")
    R = X[:3, :3]
    if np.abs(R @ R.T - np.eye(3)).max() > _LARGEST_ERROR or np.linalg.det(R) < 0.0 or (X[3] != (0, 0, 0, 1)).any():
        raise InputError("matrix: it is no rotation and translation: its rows and columns must be orthonormal, the last row 0 0 0 1")
    # The largest of the four numbers comes from a square root, the others from differences [Shepperd 1978].
    trace = float(np.trace(R))
    candidates = [trace, *(float(R[i, i]) for i in range(3))]
    largest = candidates.index(max(candidates))
    q = np.empty(4)
    if largest == 0:
        q[:] = (1.0 + trace, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q[0] = R[k, j] - R[j, k]
        q[1 + i] = 1.0 + R[i, i] - R[j, j] - R[k, k]
        q[1 + j] = R[j, i] + R[i, j]
        q[1 + k] = R[k, i] + R[i, k]
    q /= np.linalg.norm(q)
    return {"position": X[:3, 3].tolist(), "rotation": {"quaternion_wxyz": q.tolist()}}
