# SPDX-License-Identifier: Apache-2.0
import unittest

import numpy as np
import support

import prescene
from prescene.collision import Mesh


def translation(x: float, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    X = np.eye(4)
    X[:3, 3] = (x, y, z)
    return X


def random_rotations(rng: np.random.Generator, count: int) -> np.ndarray:
    q = rng.normal(size=(count, 4))
    return np.array([prescene.matrix({"rotation": {"quaternion_wxyz": one.tolist()}}) for one in q])


def sphere(radius: float = 0.5, rings: int = 24) -> Mesh:
    """A sphere about the origin, its vertices on it."""
    theta = np.linspace(0, np.pi, rings + 1)
    phi = np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    points = radius * np.stack(
        [np.outer(np.sin(theta), np.cos(phi)), np.outer(np.sin(theta), np.sin(phi)), np.outer(np.cos(theta), np.ones_like(phi))], axis=-1
    )
    faces = []
    for i in range(rings):
        for j in range(2 * rings):
            a, b = i * 2 * rings + j, i * 2 * rings + (j + 1) % (2 * rings)
            c, d = a + 2 * rings, b + 2 * rings
            faces += [[a, c, d], [a, d, b]]
    return Mesh(points.reshape(-1, 3), faces, "sphere")


class Queries(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.cube = Mesh(*support.box(), "cube")

    def test_distances_of_cubes(self) -> None:
        gaps = np.array([0.25, 1.0, 3.5, 0.0, -0.5])
        X = np.array([translation(1.0 + gap) for gap in gaps])
        found = self.cube.closest_points(self.cube, X)
        np.testing.assert_allclose(found.distance, np.maximum(gaps, 0), atol=1e-6)
        np.testing.assert_array_equal(self.cube.collides(self.cube, X), gaps <= 0)
        np.testing.assert_allclose(found.p_A[:3, 0], 0.5, atol=1e-6)
        np.testing.assert_allclose(found.p_B[:3, 0], 0.5 + gaps[:3], atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(found.p_A - found.p_B, axis=1)[:3], found.distance[:3], atol=1e-9)
        self.assertTrue((found.faces >= 0).all() and (found.faces < 12).all())

    def test_beyond_the_limit(self) -> None:
        found = self.cube.closest_points(self.cube, np.array([translation(1.1), translation(2.0)]), limit=0.2)
        self.assertTrue(np.isfinite(found.distance[0]) and np.isinf(found.distance[1]))
        self.assertTrue(np.isnan(found.p_A[1]).all() and np.isnan(found.p_B[1]).all() and (found.faces[1] == -1).all())
        for limit in (-1.0, float("nan")):
            with self.assertRaises(prescene.InputError):
                self.cube.closest_points(self.cube, np.eye(4), limit=limit)
            with self.assertRaises(prescene.InputError):
                self.cube.nearest_points([[0, 0, 0]], limit=limit)

    def test_a_single_pose_has_no_first_axis(self) -> None:
        found = self.cube.closest_points(self.cube, translation(2))
        self.assertEqual((np.shape(found.distance), found.p_A.shape, found.faces.shape), ((), (3,), (2,)))
        self.assertAlmostEqual(float(found.distance), 1.0, places=6)
        self.assertFalse(self.cube.collides(self.cube, translation(2)))
        self.assertTrue(self.cube.collides(self.cube, np.eye(4)))
        self.assertEqual(self.cube.collides(self.cube, np.zeros((0, 4, 4))).shape, (0,))

    def test_distances_of_spheres_in_any_pose(self) -> None:
        rng = np.random.default_rng(2)
        ball = sphere()
        X = random_rotations(rng, 40)
        X[:, :3, 3] = rng.normal(size=(40, 3)) * 1.5
        centres = np.linalg.norm(X[:, :3, 3], axis=1)
        found = ball.distance(ball, X)
        # The mesh lies inside of the sphere, by at most the sagitta of its edges.
        sagitta = 0.5 * (1 - np.cos(np.pi / 24))
        apart = centres - 1.0
        self.assertTrue((found >= np.maximum(apart, 0) - 1e-6).all())
        self.assertTrue((found[apart > 0] <= apart[apart > 0] + 4 * sagitta + 1e-6).all())
        # What distance says and what collide says agree.
        np.testing.assert_array_equal(ball.collides(ball, X), found == 0)

    def test_penetration_of_cubes(self) -> None:
        found = self.cube.penetrations(self.cube, np.array([translation(0.75), translation(2.0)]))
        self.assertAlmostEqual(found.depth[0], 0.25, delta=1e-3)
        np.testing.assert_allclose(found.direction[0], [1, 0, 0], atol=1e-2)
        self.assertLessEqual(found.least[0], found.depth[0])
        self.assertEqual(found.depth[1], 0.0)
        self.assertTrue(np.isnan(found.direction[1]).all())

    def test_rays_on_a_cube(self) -> None:
        origins = [[-2, 0.1, 0.2], [-2, 0.1, 0.9], [0, 0, 0.1], [-2, 0.1, 0.2]]
        directions = [[1, 0, 0], [1, 0, 0], [0, 0, 2], [0, 0, 0]]
        hits = self.cube.cast_rays(origins, directions)
        np.testing.assert_allclose(hits.t, [1.5, np.inf, 0.2, np.inf], atol=1e-7)
        np.testing.assert_array_equal(hits.front, [True, False, False, False])
        np.testing.assert_array_equal(hits.face < 0, [False, True, False, True])
        np.testing.assert_allclose(hits.weights[[0, 2]].sum(axis=1), 1.0)
        self.assertTrue(np.isnan(hits.weights[1]).all())
        corners = self.cube.vertices[self.cube.faces[hits.face[0]]]
        np.testing.assert_allclose(hits.weights[0] @ corners, [-0.5, 0.1, 0.2], atol=1e-6)
        np.testing.assert_array_equal(self.cube.cast_rays([[-2, 0.1, 0.2]], [[1, 0, 0]], t_max=1.0).t, [np.inf])

    def test_one_origin_for_all_directions(self) -> None:
        rng = np.random.default_rng(3)
        directions = rng.normal(size=(5000, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        hits = self.cube.cast_rays([[0.0, 0.0, 0.0]], directions)
        np.testing.assert_allclose(hits.t, 0.5 / np.abs(directions).max(axis=1), rtol=1e-6)
        self.assertFalse(hits.front.any())
        same = self.cube.cast_rays(np.zeros((5000, 3)), directions)
        np.testing.assert_array_equal(hits.t, same.t)

    def test_points(self) -> None:
        rng = np.random.default_rng(4)
        points = rng.uniform(-2, 2, size=(500, 3))
        found = self.cube.nearest_points(points)
        inside = np.abs(points).max(axis=1) < 0.5
        outside = np.linalg.norm(np.maximum(np.abs(points) - 0.5, 0), axis=1)
        expected = np.where(inside, 0.5 - np.abs(points).max(axis=1), outside)
        np.testing.assert_allclose(found.distance, expected, atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(found.point - points, axis=1), found.distance, atol=1e-9)
        np.testing.assert_array_equal(self.cube.winding_numbers(points), inside.astype(int))

    def test_a_mesh_of_a_scene(self) -> None:
        scene = prescene.Scene.from_yaml(support.PUSHED_BOX)
        shape = scene.models[0].visual
        assert shape is not None
        parcel = Mesh(shape.vertices, shape.faces, "parcel")
        np.testing.assert_allclose(parcel.vertices, shape.vertices, atol=1e-6)
        self.assertAlmostEqual(parcel.size, np.linalg.norm([0.08, 0.06, 0.05]), places=6)


class Refused(unittest.TestCase):
    def test_meshes(self) -> None:
        vertices, faces = support.box()
        bad = np.array(vertices)
        bad[3, 1] = np.nan
        for kind, text, arguments in (
            (prescene.InputError, "shape", (np.zeros((8, 2)), faces)),
            (prescene.InputError, "shape", (np.zeros(24), faces)),
            (prescene.InputError, "shape", (vertices, np.zeros((12, 4), int))),
            (prescene.InputError, "vertex 0 of 0", (np.zeros((0, 3)), faces)),
            (prescene.InputError, "", (vertices, np.zeros((0, 3), int))),
            (prescene.InputError, "", (bad, faces)),
            (prescene.InputError, "", (np.array(vertices) * 1e30, faces)),
            (prescene.InputError, r"faces\[1, 2\] is -1", (vertices, [[0, 1, 2], [0, 1, -1]])),
            (prescene.InputError, "", (vertices, [[0, 1, 8]])),
            (prescene.InputError, r"faces\[0, 0\]", (vertices, [[2**40, 1, 2]])),
            (prescene.InputError, "", (vertices, np.full((1, 3), 2**64 - 1, np.uint64))),
            (TypeError, "whole numbers", (vertices, np.array(faces, float))),
            (TypeError, "real numbers", (np.array(vertices, complex), faces)),
            (TypeError, "", (np.array(vertices, object), faces)),
            (TypeError, "", (np.array(vertices, str), faces)),
            (TypeError, "", (np.array(vertices) > 0, faces)),
            (TypeError, "", (None, faces)),
            (TypeError, "", ("abc", faces)),
            (TypeError, "", (vertices, None)),
            (TypeError, "", ([[1, 2, 3], [4]], faces)),
            (TypeError, "", ({}, faces)),
        ):
            with self.subTest(arguments=str(arguments)[:80]):
                with self.assertRaisesRegex(kind, text):
                    Mesh(*arguments)  # type: ignore[arg-type]

    def test_broadcast_arrays_of_any_length(self) -> None:
        _, faces = support.box()
        with self.assertRaises((prescene.InputError, MemoryError)):
            Mesh(np.broadcast_to(np.zeros(3), (2**40, 3)), faces)
        with self.assertRaises((prescene.InputError, MemoryError)):
            Mesh(*support.box()).collides(Mesh(*support.box()), np.broadcast_to(np.eye(4), (2**40, 4, 4)))

    def test_queries(self) -> None:
        cube = Mesh(*support.box())
        mirror = np.diag([1.0, 1.0, -1.0, 1.0])
        for X in (np.eye(3), np.zeros((2, 3, 4)), np.zeros((4, 4)), np.full((4, 4), np.nan), 2 * np.eye(4), mirror, np.zeros((1, 1, 4, 4)), 5.0):
            for query in (cube.collides, cube.closest_points, cube.penetrations):
                with self.assertRaises(prescene.InputError):
                    query(cube, X)  # type: ignore[operator]
        with self.assertRaisesRegex(prescene.InputError, r"X_AB\[1\]"):
            cube.collides(cube, np.stack([np.eye(4), mirror]))
        for wrong in (None, "cube", 3):
            with self.assertRaises(TypeError):
                cube.collides(wrong, np.eye(4))  # type: ignore[arg-type]
            with self.assertRaises(TypeError):
                cube.collides(cube, "X")
        with self.assertRaisesRegex(prescene.InputError, "2 origins and 3 directions"):
            cube.cast_rays(np.zeros((2, 3)), np.ones((3, 3)))
        with self.assertRaisesRegex(prescene.InputError, r"origins\[0, 2\]"):
            cube.cast_rays([[0, 0, np.inf]], [[1, 0, 0]])
        with self.assertRaises(prescene.InputError):
            cube.nearest_points([[0, 0, np.nan]])
        with self.assertRaises(prescene.InputError):
            cube.winding_numbers([1, 2, 3])
        self.assertEqual(len(cube.cast_rays(np.zeros((0, 3)), np.zeros((0, 3))).t), 0)


if __name__ == "__main__":
    unittest.main()
