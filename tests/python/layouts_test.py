# SPDX-License-Identifier: Apache-2.0
"""Arrays of every layout and type: the same answer, or a clear exception; and memory that outlives its owner."""

import gc
import threading
import unittest
from typing import Any, Callable, List

import numpy as np
import support

import prescene
from prescene.collision import Mesh


def misaligned(array: np.ndarray) -> np.ndarray:
    """The same numbers, at odd addresses."""
    memory = np.zeros(array.nbytes + 1, np.uint8)
    odd = memory[1:].view(array.dtype).reshape(array.shape)
    odd[...] = array
    return odd


def spread(array: np.ndarray) -> np.ndarray:
    """The same numbers, with others between them."""
    wide = np.full([2 * n for n in array.shape], 7, array.dtype)
    wide[tuple(slice(None, None, 2) for _ in array.shape)] = array
    return wide[tuple(slice(None, None, 2) for _ in array.shape)]


def read_only(array: np.ndarray) -> np.ndarray:
    copy = array.copy()
    copy.flags.writeable = False
    return copy


LAYOUTS: List[Callable[[np.ndarray], Any]] = [
    np.ascontiguousarray,
    np.asfortranarray,
    misaligned,
    spread,
    read_only,
    lambda array: array[::-1][::-1],
    lambda array: np.flip(np.flip(array).copy()),
    lambda array: array.astype(array.dtype.newbyteorder()),
    lambda array: array.tolist(),
    lambda array: memoryview(np.ascontiguousarray(array)),
]


class Layouts(unittest.TestCase):
    def test_every_layout_gives_the_same(self) -> None:
        rng = np.random.default_rng(5)
        vertices, faces = (np.array(one) for one in support.box())
        cube = Mesh(vertices, faces)
        X = np.tile(np.eye(4), (30, 1, 1))
        X[:, :3, 3] = rng.uniform(-2, 2, size=(30, 3))
        points = rng.uniform(-2, 2, size=(50, 3))
        directions = rng.normal(size=(50, 3))
        expected = cube.closest_points(cube, X)
        hits = cube.cast_rays(points, directions)
        nearest = cube.nearest_points(points)
        for number, layout in enumerate(LAYOUTS):
            with self.subTest(layout=number):
                other = Mesh(layout(vertices), layout(faces))
                np.testing.assert_array_equal(other.vertices, cube.vertices)
                np.testing.assert_array_equal(other.faces, cube.faces)
                for found, wanted in zip(other.closest_points(cube, layout(X)), expected):
                    np.testing.assert_array_equal(found, wanted)
                for found, wanted in zip(cube.cast_rays(layout(points), layout(directions)), hits):
                    np.testing.assert_array_equal(found, wanted)
                np.testing.assert_array_equal(cube.nearest_points(layout(points)).distance, nearest.distance)

    def test_every_type_of_number(self) -> None:
        vertices, faces = (np.array(one) for one in support.box(2.0))
        cube = Mesh(vertices, faces)
        for kind in (np.float16, np.float32, np.float64, np.longdouble, np.int8, np.int32, np.int64):
            np.testing.assert_array_equal(Mesh(vertices.astype(kind), faces).vertices, cube.vertices)
        for kind in (np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64):
            np.testing.assert_array_equal(Mesh(vertices, faces.astype(kind)).faces, cube.faces)

    def test_arrays_in_are_read_where_they_are(self) -> None:
        # A broadcast array of 2^27 rows would be 3 GiB as a copy.
        cube = Mesh(*support.box())
        many = np.broadcast_to(np.array([[2.0, 0.0, 0.0]]), (2**22, 3))
        self.assertEqual(cube.winding_numbers(many).sum(), 0)
        self.assertEqual(many.strides, (0, 8))

    def test_any_array_at_all(self) -> None:
        """Random shapes, types and values: an answer, or one of the exceptions that are stated."""
        rng = np.random.default_rng(6)
        cube = Mesh(*support.box())
        kinds: List[Any] = ["f8", "f4", ">f8", "i4", "u1", "i8", "?", "c16", "O", "U3", "S2", "M8[s]", "m8[s]", "f2", "V5"]
        answered = 0
        for trial in range(1500):
            shape = tuple(int(n) for n in rng.choice([0, 1, 2, 3, 4, 5], size=int(rng.integers(0, 5))))
            if trial % 3 == 0:
                shape = [(4, 4), (2, 4, 4), (5, 3), (12, 3)][trial // 3 % 4]
            values = rng.choice([0, 1, -1, 2, 7, 1e30, np.nan, np.inf, 2**31, -(2**40)], size=shape)
            with np.errstate(all="ignore"):
                try:
                    array = np.asarray(values).astype(kinds[trial % len(kinds)])
                except (ValueError, TypeError, OverflowError):
                    continue
            for call in (
                lambda: Mesh(array, support.box()[1]),
                lambda: Mesh(support.box()[0], array),
                lambda: cube.collides(cube, array),
                lambda: cube.closest_points(cube, array),
                lambda: cube.penetrations(cube, array),
                lambda: cube.cast_rays(array, array),
                lambda: cube.nearest_points(array),
                lambda: cube.winding_numbers(array),
                lambda: prescene.pose(array),
            ):
                try:
                    call()
                    answered += 1
                except (TypeError, ValueError):
                    pass
        self.assertGreater(answered, 20)


class Lifetimes(unittest.TestCase):
    def test_views_outlive_what_they_view(self) -> None:
        mesh = Mesh(*support.box())
        vertices, faces = mesh.vertices, mesh.faces
        del mesh
        gc.collect()
        _ = [np.zeros(10_000) for _ in range(100)]
        np.testing.assert_array_equal(np.abs(vertices), 0.5)
        self.assertEqual(faces.max(), 7)

    def test_arrays_in_may_be_changed_and_freed_afterwards(self) -> None:
        vertices = np.array(support.box()[0])
        mesh = Mesh(vertices, support.box()[1])
        vertices[...] = np.nan
        del vertices
        gc.collect()
        self.assertTrue(mesh.collides(mesh, np.eye(4)))

    def test_answers_are_the_callers_own(self) -> None:
        mesh = Mesh(*support.box())
        first = mesh.cast_rays([[-2, 0, 0]], [[1, 0.01, 0.02]])
        first.t[0] = 7
        self.assertNotEqual(mesh.cast_rays([[-2, 0, 0]], [[1, 0.01, 0.02]]).t[0], 7)


class Threads(unittest.TestCase):
    def test_threads_share_meshes_and_scenes(self) -> None:
        rng = np.random.default_rng(7)
        cube = Mesh(*support.box())
        scene = prescene.Scene.from_yaml(support.PUSHED_BOX)
        X = np.tile(np.eye(4), (2000, 1, 1))
        X[:, :3, 3] = rng.uniform(-2, 2, size=(2000, 3))
        expected = cube.distance(cube, X)
        prediction = support.without_times(prescene.predict(scene, max_instances=64, outcomes_only=True).json)
        wrong: List[str] = []

        def work(number: int) -> None:
            try:
                if number % 2:
                    np.testing.assert_array_equal(cube.distance(cube, X), expected)
                else:
                    found = prescene.predict(scene, max_instances=64, outcomes_only=True).json
                    assert support.without_times(found) == prediction
            except BaseException as error:  # whatever it is, the test is to say so
                wrong.append(repr(error))

        threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])


if __name__ == "__main__":
    unittest.main()
