# SPDX-License-Identifier: Apache-2.0
import gc
import os
import pathlib
import pickle
import tempfile
import unittest

import numpy as np
import support

import prescene

CUBE = """
name: cube
models:
  cube:
    box: [0.1, 0.2, 0.3]
    mass: {normal: [1.5, 0.1], min: 1.2, max: 2}
    friction: 0.4
    color: [0.1, 0.2, 0.3]
supports:
  table:
    box: [1, 1, 0.1]
    pose: {position: [0, 0, -0.05]}
    friction: 0.8
robot:
  hand:
    box: [0.1, 0.1, 0.1]
    timeline:
      - {time: 0.0, position: [0, 0, 1]}
      - {time: 2.0, position: [1, 0, 1]}
objects:
  first:
    model: cube
    pose: {position: [0.1, 0.2, 0.15], rotation: {euler_deg: [0, 0, 90]}, normal: {position: [0.01, 0.02, 0.03], rotation_deg: 10}}
  second:
    model: cube
    pose: {position: [0, 0, 0.9]}
    held_by: hand
camera:
  width: 320
  height: 240
  fov_deg: 60
  look: {from: [1, 0, 1], at: [0, 0, 0]}
"""


# Without a support, which is allowed but unlikely to be meant.
FALLING = """
name: falling
models:
  ball: {sphere: {radius: 0.05}, mass: 1}
objects:
  ball: {model: ball, pose: {position: [0, 0, 1]}}
"""


class Scenes(unittest.TestCase):
    def test_values_are_those_of_the_file(self) -> None:
        scene = prescene.Scene.from_yaml(CUBE)
        self.assertEqual(scene.name, "cube")
        self.assertEqual([one.name for one in scene.objects], ["first", "second"])
        first, second = scene.objects
        self.assertEqual(first.model.mass.mean, prescene.Scene.from_yaml(CUBE).models[0].mass.mean)
        self.assertAlmostEqual(first.model.mass.mean, 1.5, places=2)  # cut to [1.2, 2]
        self.assertEqual((first.model.mass.low, first.model.mass.high), (1.2, 2.0))
        self.assertEqual(first.model.friction.standard_deviation, 0.0)
        self.assertEqual(first.model.color, (0.1, 0.2, 0.3))
        np.testing.assert_allclose(first.X_WO, [[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.15], [0, 0, 0, 1]], atol=1e-12)
        np.testing.assert_allclose(np.diag(first.covariance), [np.radians(10) ** 2] * 3 + [1e-4, 4e-4, 9e-4], rtol=1e-9)
        self.assertEqual((first.held_by, second.held_by), (None, "hand"))
        # A solid box of 1 kg: (b^2 + c^2) / 12 about the axis along a.
        np.testing.assert_allclose(
            np.diag(first.model.unit_inertia), np.array([0.04 + 0.09, 0.01 + 0.09, 0.01 + 0.04]) / 12, rtol=1e-9
        )
        np.testing.assert_allclose(scene.gravity_W, [0, 0, -9.81])
        np.testing.assert_allclose(scene.support("table").X_WS[:3, 3], [0, 0, -0.05])
        hand = scene.robot[0]
        np.testing.assert_allclose(hand.times, [0, 2])
        np.testing.assert_allclose(hand.X_WG[:, 0, 3], [0, 1])
        assert scene.camera is not None
        focal_length = 160 / np.tan(np.radians(30))
        np.testing.assert_allclose(scene.camera.K[0, 0], focal_length, rtol=1e-9)
        self.assertEqual([camera.name for camera in scene.cameras], ["camera"])

    def test_several_cameras(self) -> None:
        places = "look: {from: [1, 0, 1], at: [0, 0, 0]}"
        listed = f"cameras:\n  - {{name: front, fov_deg: 60, {places}}}\n  - {{name: wrist, fov_deg: 40}}\n"
        scene = prescene.Scene.from_yaml(FALLING + listed)
        self.assertEqual([(camera.name, camera.is_placed) for camera in scene.cameras], [("front", True), ("wrist", False)])
        assert scene.camera is not None
        self.assertEqual(scene.camera.name, "front")
        np.testing.assert_array_equal(scene.cameras[1].X_WC, np.eye(4))

    def test_meshes_are_read_only_views_that_keep_their_scene(self) -> None:
        scene = prescene.Scene.from_yaml(CUBE)
        mesh = scene.models[0].visual
        assert mesh is not None
        vertices, faces = mesh.vertices, mesh.faces
        self.assertEqual((vertices.dtype, vertices.shape[1]), (np.float64, 3))
        self.assertEqual((faces.dtype, faces.shape[1]), (np.uint32, 3))
        self.assertFalse(vertices.flags.owndata)
        np.testing.assert_array_equal(vertices.__array_interface__["data"], mesh.vertices.__array_interface__["data"])
        for array in (vertices, faces, scene.objects[0].X_WO, scene.gravity_W):
            with self.assertRaises(ValueError):
                array[0] = 0
        with self.assertRaises(ValueError):
            vertices.flags.writeable = True
        del scene, mesh
        gc.collect()
        np.testing.assert_allclose(vertices.max(axis=0), [0.05, 0.1, 0.15])
        self.assertLess(faces.max(), len(vertices))

    def test_parts_keep_their_scene(self) -> None:
        part = prescene.Scene.from_yaml(CUBE).objects[0].model
        gc.collect()
        self.assertEqual(part.name, "cube")
        self.assertEqual(len(part.collision_mesh().faces), 12)

    def test_every_mistake_is_told_with_line_and_remedy(self) -> None:
        text = CUBE.replace("friction: 0.4", "frictoin: 0.4").replace("held_by: hand", "held_by: hnad")
        with self.assertRaises(prescene.InputError) as caught:
            prescene.Scene.from_yaml(text, path="desk.yaml")
        error = caught.exception
        self.assertIsInstance(error, ValueError)
        self.assertEqual(error.code, "invalid_input")
        lines = text.splitlines()
        self.assertGreaterEqual(len(error.problems), 2)
        for problem in error.problems:
            self.assertEqual(problem.file, "desk.yaml")
            self.assertTrue(problem.remedy)
        self.assertIn("frictoin", lines[error.problems[0].line - 1])
        self.assertEqual((error.file, error.line, error.remedy), ("desk.yaml", *error.problems[0][1:2], error.problems[0].remedy))
        self.assertEqual(pickle.loads(pickle.dumps(error)).problems, error.problems)

    def test_errors_are_those_of_the_command_line(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            bad = pathlib.Path(folder) / "bad.yaml"
            bad.write_text(CUBE.replace("mass: {normal: [1.5, 0.1], min: 1.2, max: 2}", "mass: -1"))
            missing = pathlib.Path(folder) / "missing.yaml"
            for path in (bad, missing, pathlib.Path(folder)):
                with self.assertRaises(prescene.InputError) as caught:
                    prescene.load_scene(path)
                done = support.run_program("predict", str(path), "--quiet")
                self.assertEqual(done.returncode, 2)
                self.assertIn(str(caught.exception), done.stderr)

    def test_paths_of_all_kinds(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = support.write_scene(pathlib.Path(folder))
            odd = os.path.join(os.fsencode(folder), b"\xff\xfe.yaml")
            with open(odd, "w") as file:
                file.write(CUBE)
            for given in (path, str(path), os.fsencode(path)):
                self.assertEqual(prescene.load_scene(given).name, "pushed_box")  # type: ignore[arg-type]
            self.assertEqual(prescene.load_scene(os.fsdecode(odd)).name, "cube")
            os.remove(odd)
            with self.assertRaises(prescene.InputError):
                prescene.load_scene(os.fsdecode(odd))
        for wrong in (None, 3, object(), "a\0b"):
            with self.assertRaises((TypeError, ValueError)):
                prescene.load_scene(wrong)  # type: ignore[arg-type]

    def test_names_that_are_not_there(self) -> None:
        scene = prescene.Scene.from_yaml(CUBE)
        with self.assertRaisesRegex(prescene.InputError, "no object 'mug': there are first, second"):
            scene.object("mug")
        with self.assertRaises(prescene.InputError):
            scene.support("mug")
        self.assertEqual(scene.object("second").name, "second")

    def test_warnings_are_logged(self) -> None:
        with self.assertNoLogs("prescene"):
            prescene.Scene.from_yaml(CUBE)
        with self.assertLogs("prescene", "WARNING") as logs:
            prescene.Scene.from_yaml(FALLING)
        self.assertIn("scene.yaml", logs.output[0])
        self.assertIn("no support", logs.output[0])

    def test_scene_files_of_the_project(self) -> None:
        for path in sorted(support.SCENARIOS.glob("*.yaml")):
            scene = prescene.load_scene(path)
            for thing in scene.objects:
                X = thing.X_WO
                np.testing.assert_allclose(X[:3, :3] @ X[:3, :3].T, np.eye(3), atol=1e-9)
                self.assertGreater(thing.model.mass.mean, 0.0)
                self.assertGreaterEqual(np.linalg.eigvalsh(thing.covariance).min(), -1e-12)


class Poses(unittest.TestCase):
    def test_there_and_back(self) -> None:
        rng = np.random.default_rng(1)
        for _ in range(200):
            q = rng.normal(size=4) * rng.choice([1.0, 1e-9, 1.0, 1.0], size=4)
            given = {"position": rng.normal(size=3).tolist(), "rotation": {"quaternion_wxyz": (q / np.linalg.norm(q)).tolist()}}
            X = prescene.matrix(given)
            np.testing.assert_allclose(X[:3, :3] @ X[:3, :3].T, np.eye(3), atol=1e-12)
            np.testing.assert_allclose(prescene.matrix(prescene.pose(X)), X, atol=1e-12)
        np.testing.assert_allclose(prescene.matrix({}), np.eye(4))

    def test_what_is_no_pose(self) -> None:
        mirror = np.diag([1.0, 1.0, -1.0, 1.0])
        for wrong in (np.eye(3), np.full((4, 4), np.nan), 2 * np.eye(4), mirror, "x", None, np.zeros((0, 4))):
            with self.assertRaises(prescene.InputError):
                prescene.pose(wrong)  # type: ignore[arg-type]
        for bad in ({"position": [1, 2]}, {"rotation": 3}, {"rotation": {"quaternion_wxyz": [0, 0, 0, 0]}}, {"position": [np.inf, 0, 0]}):
            with self.assertRaises(prescene.InputError):
                prescene.matrix(bad)


if __name__ == "__main__":
    unittest.main()
