# SPDX-License-Identifier: Apache-2.0
"""What a process goes through: forks, daemon threads, and its end in the middle of things."""

import multiprocessing
import pathlib
import subprocess
import sys
import tempfile
import textwrap
import unittest

import support

import prescene


def predict_in(queue: "multiprocessing.Queue[str]") -> None:
    try:
        scene = prescene.Scene.from_yaml(support.PUSHED_BOX)
        queue.put(str(prescene.predict(scene, max_instances=32, outcomes_only=True).instances))
    except RuntimeError as error:
        queue.put(str(error))


class Processes(unittest.TestCase):
    def run_python(self, text: str, *arguments: str) -> "subprocess.CompletedProcess[str]":
        return subprocess.run([sys.executable, "-c", textwrap.dedent(text), *arguments], capture_output=True, text=True, check=False, timeout=120)

    def answer_of(self, method: str) -> str:
        context = multiprocessing.get_context(method)
        queue = context.Queue()
        process = context.Process(target=predict_in, args=(queue,))
        process.start()
        answer = queue.get(timeout=120)
        process.join()
        self.assertEqual(process.exitcode, 0)
        return answer

    def test_spawned_processes_work_and_forked_ones_say_why_not(self) -> None:
        scene = prescene.Scene.from_yaml(support.PUSHED_BOX)
        prescene.predict(scene, max_instances=32, outcomes_only=True)
        self.assertEqual(self.answer_of("spawn"), "32")
        self.assertIn("spawn", self.answer_of("fork"))

    def test_a_fork_before_any_work_works(self) -> None:
        done = self.run_python(
            """
            import os, sys, prescene
            child = os.fork()
            scene = prescene.Scene.from_yaml(open(sys.argv[1]).read())
            print(prescene.predict(scene, max_instances=32, outcomes_only=True).instances, flush=True)
            if child:
                sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
            """,
            str(self.scene_file),
        )
        self.assertEqual((done.returncode, done.stdout.split(), done.stderr), (0, ["32", "32"], ""))

    def test_ends_in_the_middle_of_a_replay(self) -> None:
        for end in ("sys.exit(0)", "frames.close()", "del frames", "os.fork() or os._exit(0)"):
            with self.subTest(end=end):
                done = self.run_python(
                    f"""
                    import os, sys, prescene
                    frames = prescene.replay(sys.argv[1])
                    frame = next(frames)
                    depth = frame.depth
                    {end}
                    """,
                    str(self.recording),
                )
                self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_a_forked_child_drops_a_replay(self) -> None:
        done = self.run_python(
            """
            import gc, os, sys, prescene
            frames = prescene.replay(sys.argv[1])
            next(frames)
            child = os.fork()
            if child == 0:
                del frames
                gc.collect()
                sys.exit(0)
            sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
            """,
            str(self.recording),
        )
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_ends_while_a_daemon_thread_works(self) -> None:
        done = self.run_python(
            """
            import sys, threading, prescene
            from prescene.collision import Mesh
            scene = prescene.Scene.from_yaml(open(sys.argv[1]).read())
            entered = threading.Event()
            def work():
                entered.set()
                while True:
                    prescene.predict(scene, max_instances=16, outcomes_only=True)
            for _ in range(3):
                threading.Thread(target=work, daemon=True).start()
            entered.wait()
            """,
            str(self.scene_file),
        )
        self.assertEqual(done.returncode, 0, done.stderr)

    @classmethod
    def setUpClass(cls) -> None:
        cls.temporary = tempfile.TemporaryDirectory()
        folder = pathlib.Path(cls.temporary.name)
        cls.recording = support.make_recording(folder)
        cls.scene_file = folder / "pushed_box.yaml"

    @classmethod
    def tearDownClass(cls) -> None:
        cls.temporary.cleanup()


if __name__ == "__main__":
    unittest.main()
