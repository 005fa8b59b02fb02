# SPDX-License-Identifier: Apache-2.0
"""Exact collision, distance and ray queries on triangle meshes, for many poses, rays or points at a time.

    cup = collision.Mesh(vertices, faces)
    cup.collides(table, X_CT)                # X_CT (4, 4): a bool; (n, 4, 4): an array of n

Lengths are metres. X_AB is the pose of mesh B in the frame of mesh A, a homogeneous matrix. Float64 arrays are read
where they are, whatever their strides; others are converted by numpy first. A mesh keeps its own copy in single
precision, and so do poses: see docs/reference/collision.md for what is exact. Points and rays are in double precision.
The GIL is released, so that threads of Python work at the same time.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _prescene
from .errors import InputError

__all__ = ["ClosestPoints", "Mesh", "NearestPoints", "Penetrations", "RayHits"]


class ClosestPoints(NamedTuple):
    """Of each pose; of a single pose without the first axis."""

    distance: NDArray[np.float64]  #: (n,) m; 0 where the meshes touch, inf beyond the limit.
    p_A: NDArray[np.float64]  #: (n, 3) m: the nearest point of A, in A's frame; NaN beyond the limit.
    p_B: NDArray[np.float64]  #: (n, 3) m: that of B, in A's frame too.
    faces: NDArray[np.int64]  #: (n, 2): on which they are, in A and in B; -1 beyond the limit.


class Penetrations(NamedTuple):
    """Of each pose; of a single pose without the first axis."""

    depth: NDArray[np.float64]  #: (n,) m: B moved so far along `direction` is apart from A; 0 = they are apart.
    least: NDArray[np.float64]  #: (n,) m: no shorter translation takes them apart.
    direction: NDArray[np.float64]  #: (n, 3) of length 1, in A's frame; NaN where they are apart.


class RayHits(NamedTuple):
    """Of each ray."""

    t: NDArray[np.float64]  #: (n,) in lengths of the direction; inf = no hit.
    face: NDArray[np.int64]  #: (n,); -1 = no hit.
    weights: NDArray[np.float64]  #: (n, 3) barycentric; NaN = no hit.
    front: NDArray[np.bool_]  #: (n,) hit on the side from which the corners go round counter-clockwise.


class NearestPoints(NamedTuple):
    """Of each point."""

    distance: NDArray[np.float64]  #: (n,) m; inf beyond the limit.
    point: NDArray[np.float64]  #: (n, 3) m, on the surface; NaN beyond the limit.
    face: NDArray[np.int64]  #: (n,); -1 beyond the limit.


class Mesh:
    """A triangle mesh with the tree that queries descend. It never changes, and threads may share it."""

    def __init__(self, vertices: ArrayLike, faces: ArrayLike, name: str = "mesh") -> None:
        """From vertices (n, 3), m, and faces (m, 3), whole numbers that count vertices from 0.

        `name` stands in error messages. Raises InputError for another shape, a number that is not finite, an index
        that is out of range, and a mesh without faces; TypeError for what is no array of numbers.
        """
        self._inner = _prescene.CollisionMesh(vertices, faces, name)

    @property
    def vertices(self) -> NDArray[np.float32]:
        """(n, 3) m: what is collided with. A read-only view, without a copy."""
        return self._inner.vertices

    @property
    def faces(self) -> NDArray[np.uint32]:
        """(m, 3). A read-only view, without a copy."""
        return self._inner.faces

    @property
    def name(self) -> str:
        return self._inner.name

    @property
    def size(self) -> float:
        """Length of the bounding box's diagonal, m."""
        return self._inner.size

    @property
    def report(self) -> str:
        """What is unusual about the mesh, such as triangles without area; "" = nothing."""
        return self._inner.report

    def collides(self, other: "Mesh", X_AB: ArrayLike) -> Union[bool, NDArray[np.bool_]]:
        """Whether a triangle of this mesh and one of `other` have a point in common. Exact."""
        found = self._inner.collides(_inner_of(other), X_AB)
        return found if isinstance(found, np.ndarray) else bool(found)

    def closest_points(self, other: "Mesh", X_AB: ArrayLike, limit: float = math.inf) -> ClosestPoints:
        """How far apart the meshes are, and where. What is farther apart than `limit` (m) is not looked for."""
        return ClosestPoints(*self._inner.closest_points(_inner_of(other), X_AB, _limit(limit)))

    def distance(self, other: "Mesh", X_AB: ArrayLike, limit: float = math.inf) -> NDArray[np.float64]:
        """The first of closest_points."""
        return self.closest_points(other, X_AB, limit).distance

    def penetrations(self, other: "Mesh", X_AB: ArrayLike) -> Penetrations:
        """How deep two solids, closed meshes, overlap."""
        return Penetrations(*self._inner.penetrations(_inner_of(other), X_AB))

    def cast_rays(
        self, origins: ArrayLike, directions: ArrayLike, t_min: float = 0.0, t_max: float = math.inf
    ) -> RayHits:
        """Where rays hit first: origins and directions (n, 3), or (1, 3) of one for all, in the mesh's frame.

        A hit is at origin + t direction with t in [t_min, t_max]. A direction of length zero hits nothing. Rays that go
        the same way are faster when they stand side by side.
        """
        return RayHits(*self._inner.cast_rays(origins, directions, t_min, t_max))

    def nearest_points(self, points: ArrayLike, limit: float = math.inf) -> NearestPoints:
        """The place of the surface that is nearest to each of the points (n, 3), m."""
        return NearestPoints(*self._inner.nearest_points(points, _limit(limit)))

    def winding_numbers(self, points: ArrayLike) -> NDArray[np.int32]:
        """(n,): how often a closed surface winds around each of the points (n, 3): 1 = inside, 0 = outside."""
        return self._inner.winding_numbers(points)

    def __repr__(self) -> str:
        return f"<collision.Mesh '{self.name}' of {len(self.faces)} triangles>"


def _inner_of(mesh: "Mesh") -> _prescene.CollisionMesh:
    if not isinstance(mesh, Mesh):
        raise TypeError(f"other: a collision.Mesh is needed, not {type(mesh).__name__}")
    return mesh._inner


def _limit(limit: float) -> float:
    if not limit >= 0.0:
        raise InputError(f"limit: {limit} is out of range: give metres of at least 0")
    return limit
