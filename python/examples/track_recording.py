#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Where the objects of a recording are, frame by frame, what is learned of them, and whether they will stay.

    track_recording.py RECORDING [SCENE]
"""

import sys
from typing import Optional

import numpy as np

import prescene


def main(recording: str, scene: Optional[str]) -> None:
    last = None
    with prescene.replay(recording, scene) as frames:
        for frame in frames:
            last = frame
            for thing in frame.objects:
                deviation = 1e3 * np.sqrt(np.trace(thing.covariance[3:, 3:]))
                x, y, z = thing.X_WO[:3, 3]
                print(
                    f"{frame.time:7.3f} s  {thing.name:12} {thing.state:9} confidence {thing.confidence:.2f}"
                    f"  ({x:+.3f}, {y:+.3f}, {z:+.3f}) m +- {deviation:.1f} mm"
                )
        if last is None:
            print("the recording holds no frame")
            return
        for thing in last.objects:
            for parameter in thing.parameters.values():
                print(
                    f"{thing.name}: {parameter.name} {parameter.mean:.3f} +- {parameter.standard_deviation:.3f}"
                    f" after {thing.lessons} lessons"
                )
            if thing.state == "lost":
                continue
            answer = prescene.ask(last, {"stability": {"object": thing.name, "effort": {"max_instances": 128}}})
            print(f"{thing.name} stays with probability {answer['stability']['stable']['probability']:.2f}")
        print("summary:", frames.summary)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    try:
        main(sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else None)
    except prescene.InputError as error:
        sys.exit(str(error))
