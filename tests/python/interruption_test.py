# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C ends long calls, and other threads of Python work meanwhile.

A second thread waits until the first is inside of a call that would take hours, and interrupts it then. If calls held the
GIL, it would never get to do so, and the test would run into its time limit.
"""

import pathlib
import signal
import sys
import tempfile
import threading
import unittest
from types import FrameType
from typing import Any, Callable, Optional

import numpy as np
import support

import prescene
from prescene.collision import Mesh

ENDLESS = {"half_width": 1e-4, "max_instances": 2**22, "duration": 60.0}


class Interrupted(unittest.TestCase):
    def interrupt(self, call: Callable[[], Any], inside: str, number: int = signal.SIGINT) -> None:
        """Calls; sends the signal once the function of that name is what the main thread runs."""
        main = threading.main_thread().ident
        over = threading.Event()

        def watch() -> None:
            while not over.is_set():
                frame: Optional[FrameType] = sys._current_frames().get(main or 0)
                if frame is not None and frame.f_code.co_name == inside:
                    # From now on it may be inside of the compiled part; until then Python itself would hear of it.
                    signal.pthread_kill(main or 0, number)
                    return

        watcher = threading.Thread(target=watch)
        watcher.start()
        try:
            call()
        finally:
            over.set()
            watcher.join()

    def test_predict(self) -> None:
        scene = prescene.Scene.from_yaml(support.PUSHED_BOX.replace("duration: 1.5", "duration: 60\nstop_at_rest: false"))
        for stepper in ("automatic", "bullet"):
            with self.assertRaises(KeyboardInterrupt):
                self.interrupt(lambda: prescene.predict(scene, stepper=stepper, **ENDLESS), "ask")
        # What was interrupted has left nothing behind.
        self.assertEqual(prescene.predict(scene, max_instances=16, duration=0.5, outcomes_only=True).instances, 16)

    def test_ask(self) -> None:
        scene = prescene.Scene.from_yaml(support.PUSHED_BOX)
        effort = {"tolerance": 1e-4, "max_instances": 2**22}
        question = {"achieve": {"outcome": "moved", "action": "push", "object": "parcel", "free": ["distance", "direction_deg", "offset"], "probability": 0.999, "effort": effort}}
        with self.assertRaises(KeyboardInterrupt):
            self.interrupt(lambda: prescene.ask(scene, {"stability": {"object": "parcel", "duration": 3600, "effort": effort}}), "ask")
        with self.assertRaises(KeyboardInterrupt):
            self.interrupt(lambda: self.again(lambda: prescene.ask(scene, question)), "ask")

    def test_collision(self) -> None:
        cube = Mesh(*support.box())
        X = np.broadcast_to(np.eye(4), (100_000, 4, 4))
        with self.assertRaises(KeyboardInterrupt):
            self.interrupt(lambda: self.again(lambda: cube.penetrations(cube, X)), "penetrations")
        rays = np.broadcast_to(np.ones((1, 3)), (2**22, 3))
        with self.assertRaises(KeyboardInterrupt):
            self.interrupt(lambda: self.again(lambda: cube.cast_rays(rays, rays)), "cast_rays")

    def again(self, call: Callable[[], Any]) -> None:
        while True:
            call()

    def test_replay_loses_no_frame(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            recording = support.make_recording(pathlib.Path(folder))
            expected = [frame.belief_hash for frame in prescene.replay(recording)]
            found = []
            frames = prescene.replay(recording)
            interrupted = 0
            while True:
                try:
                    # None while the last one is read: it is looked for below.
                    if interrupted < 3 and len(found) + interrupted + 1 < len(expected):
                        self.interrupt(lambda: found.append(next(frames).belief_hash), "__next__")
                    else:
                        found.append(next(frames).belief_hash)
                except KeyboardInterrupt:
                    interrupted += 1
                except StopIteration:
                    break
            # An interrupt that comes after a frame is there, and before it is kept, loses that one.
            self.assertGreaterEqual(len(found), len(expected) - 3)
            self.assertEqual(found[-1], expected[-1])
            self.assertTrue(set(found) <= set(expected))

    def test_other_handlers_run_and_may_let_it_go_on(self) -> None:
        scene = prescene.Scene.from_yaml(support.PUSHED_BOX)
        heard = []
        before = signal.signal(signal.SIGUSR1, lambda *_: heard.append(1))
        try:
            expected = support.without_times(prescene.predict(scene, max_instances=256, half_width=1e-3).json)
            result = []
            while not heard:  # A busy machine may be done before the other thread looks.
                result.clear()
                self.interrupt(lambda: result.append(prescene.predict(scene, max_instances=256, half_width=1e-3).json), "ask", signal.SIGUSR1)
            self.assertEqual(heard, [1])
            self.assertEqual(support.without_times(result[0]), expected)
        finally:
            signal.signal(signal.SIGUSR1, before)


if __name__ == "__main__":
    unittest.main()
