# SPDX-License-Identifier: Apache-2.0
import gc
import math
import pathlib
import tempfile
import threading
import unittest

import numpy as np
import support

import prescene


class Replays(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.recording = support.make_recording(cls.folder)

    @classmethod
    def tearDownClass(cls) -> None:
        cls.temporary.cleanup()

    def test_is_bit_for_bit_the_command_line(self) -> None:
        expected = support.program_json("replay", str(self.recording))
        frames = prescene.replay(self.recording)
        found = list(frames)
        self.assertEqual(frames.seed, expected["seed"])
        self.assertEqual([one.belief_hash for one in found], [step["belief_hash"] for step in expected["steps"]])
        for frame, step in zip(found, expected["steps"]):
            self.assertEqual((frame.step, frame.stamp_ns), (step["step"], step["stamp_ns"]))
            for thing, said in zip(frame.objects, step["objects"]):
                self.assertEqual((thing.name, thing.model, thing.state), (said["name"], said["model"], said["state"]))
                self.assertEqual(thing.confidence, said["confidence"])
                np.testing.assert_array_equal(thing.covariance.ravel(), said["covariance"])
                np.testing.assert_allclose(thing.X_WO, prescene.matrix(said["pose"]), atol=1e-12)
                self.assertEqual(list(thing.parameters), [one["name"] for one in said["parameters"]])
                for one in said["parameters"]:
                    self.assertEqual(thing.parameters[one["name"]].mean, one["mean"])
        summary = frames.summary
        assert summary is not None
        for key in ("messages", "skipped_frames", "compared_steps", "different_steps", "loss"):
            self.assertEqual(summary[key], expected[key])

    def test_tracks_what_was_simulated(self) -> None:
        last = None
        times = []
        for last in prescene.replay(self.recording, seed=1):
            times.append(last.time)
        self.assertEqual(times[0], 0.0)
        self.assertEqual(times, sorted(times))
        assert last is not None
        parcel = last.object("parcel")
        self.assertEqual(parcel.state, "tracked")
        self.assertGreater(parcel.X_WO[0, 3], 0.1)  # it was pushed to where x is larger
        np.testing.assert_allclose(parcel.X_WO[2, 3], 0.025, atol=0.01)
        self.assertGreaterEqual(np.linalg.eigvalsh(parcel.covariance).min(), -1e-12)
        with self.assertRaises(prescene.InputError):
            last.object("mug")

    def test_images_are_views_that_outlive_the_replay(self) -> None:
        with prescene.replay(self.recording) as frames:
            frame = next(frames)
        del frames
        depth, color = frame.depth, frame.color
        assert depth is not None
        self.assertEqual((depth.dtype, depth.shape), (np.float32, (120, 160)))
        self.assertEqual(frame.camera, 0)
        self.assertFalse(depth.flags.writeable or depth.flags.owndata)
        self.assertTrue(color is None or (color.dtype, color.shape) == (np.uint8, (120, 160, 3)))
        objects = frame.objects
        del frame
        gc.collect()
        self.assertTrue(0.3 < np.median(depth[depth > 0]) < 1.5)
        self.assertEqual(objects[0].name, "parcel")

    def test_questions_about_a_frame(self) -> None:
        frames = prescene.replay(self.recording)
        frame = next(frames)
        where = prescene.ask(frame, {"where": {}})
        self.assertEqual(where["step"], frame.step)
        item = where["where"]["items"][0]
        np.testing.assert_allclose(prescene.matrix(item["estimate"]["mean"]), frame.objects[0].X_WO, atol=1e-9)
        prediction = prescene.predict(frame, max_instances=64, actions=[], outcomes={"moved": {"object": "parcel", "moved_more_than": 0.05}})
        self.assertEqual(prediction.json["belief_step"], frame.step)
        self.assertLess(prediction["moved"].probability, 0.2)
        # Asking changes nothing of what comes next.
        rest = [one.belief_hash for one in frames]
        self.assertEqual(rest, [one.belief_hash for one in prescene.replay(self.recording)][1:])
        with self.assertRaises(prescene.InputError):
            prescene.ask(frame, {"where": {}}, seed=2)

    def test_ends_early_and_twice(self) -> None:
        frames = prescene.replay(self.recording)
        next(frames)
        frames.close()
        frames.close()
        with self.assertRaises(StopIteration):
            next(frames)
        self.assertEqual(list(frames), [])
        for _ in range(3):  # dropped while it waits
            next(prescene.replay(self.recording))
        prescene.replay(self.recording)  # never begun

    def test_learned_files(self) -> None:
        frames = prescene.replay(self.recording)
        prior = frames.learned
        for _ in frames:
            pass
        self.assertNotEqual(prior, "")
        kept = self.folder / "learned.yaml"
        kept.write_text(frames.learned)
        again = next(prescene.replay(self.recording, learned=kept))
        self.assertEqual(again.objects[0].name, "parcel")
        with self.assertRaises(prescene.InputError):
            prescene.replay(self.recording, learned=self.folder / "none.yaml")

    def test_a_window_and_another_scene(self) -> None:
        frames = list(prescene.replay(self.recording, begin=0.5, end=1.0))
        self.assertTrue(0 < len(frames) < len(list(prescene.replay(self.recording))))
        self.assertLessEqual(frames[-1].time, 0.5)
        other = prescene.replay(self.recording, scene=self.folder / "pushed_box.yaml")
        self.assertEqual(other.scene.name, "pushed_box")

    def test_what_is_refused(self) -> None:
        damaged = self.folder / "damaged.mcap"
        content = bytearray(self.recording.read_bytes())
        content[len(content) // 2] ^= 0xFF
        damaged.write_bytes(content)
        (self.folder / "empty.mcap").write_bytes(b"")
        (self.folder / "text.mcap").write_text("no recording at all")
        for name in ("none.mcap", "empty.mcap", "text.mcap", "damaged.mcap", "."):
            with self.subTest(name=name):
                with self.assertRaises(prescene.InputError):
                    list(prescene.replay(self.folder / name))
                self.assertNotEqual(support.run_program("replay", str(self.folder / name), "--quiet").returncode, 0)
        self.assertGreater(len(list(prescene.replay(damaged, salvage=True))), 0)
        for options in (
            {"begin": -1.0},
            {"begin": math.nan},
            {"begin": math.inf},
            {"end": 0.0},
            {"end": math.nan},
            {"depth_scale": 0.0},
            {"frame_rate": math.nan},
            {"seed": -1},
            {"threads": -2},
            {"scene": self.folder / "none.yaml"},
        ):
            with self.subTest(options=str(options)):
                with self.assertRaises(prescene.InputError):
                    prescene.replay(self.recording, **options)
        for wrong in (None, 3, object()):
            with self.assertRaises(TypeError):
                prescene.replay(wrong)  # type: ignore[arg-type]

    def test_threads_share_a_replay_frame_by_frame(self) -> None:
        expected = [one.belief_hash for one in prescene.replay(self.recording)]
        frames = prescene.replay(self.recording)
        found = []
        wrong = []

        def work() -> None:
            while True:
                try:
                    found.append(next(frames).belief_hash)
                except StopIteration:
                    return
                except prescene.InputError as error:  # another one asks just now
                    if "another thread" not in str(error):
                        wrong.append(error)
                        return

        threads = [threading.Thread(target=work) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])
        self.assertEqual(sorted(found), sorted(expected))


if __name__ == "__main__":
    unittest.main()
