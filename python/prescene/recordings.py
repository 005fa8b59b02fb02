# SPDX-License-Identifier: Apache-2.0
"""Recordings, tracked frame by frame."""

from __future__ import annotations

import json
import math
import os
from types import TracebackType
from typing import Any, Dict, Iterator, Optional, Type, Union

from . import _prescene
from .questions import check_seed

__all__ = ["Replay", "replay"]

PathLike = Union[str, "os.PathLike[str]"]


class Replay(Iterator[_prescene.Frame]):
    """A recording that is tracked as far as one asks: `for frame in replay`, `next(replay)`.

    Each frame is worked out when it is asked for. Ctrl-C loses none: the next call gives the frame that was in work.
    """

    def __init__(self, inner: _prescene.Replay) -> None:
        self._inner = inner

    @property
    def scene(self) -> _prescene.Scene:
        """That the recording is tracked with."""
        return self._inner.scene

    @property
    def seed(self) -> int:
        return self._inner.seed

    @property
    def learned(self) -> str:
        """What was learned of physical parameters up to the newest frame: the text of a learned file."""
        return self._inner.learned

    @property
    def summary(self) -> Optional[Dict[str, Any]]:
        """What `prescene replay --json` says of the whole, such as "steps" and "different_steps"; None before the end."""
        text = self._inner.summary_json
        return json.loads(text) if text else None

    def close(self) -> None:
        """Ends it early. Frames that were given stay valid."""
        self._inner.close()

    def __iter__(self) -> "Replay":
        return self

    def __next__(self) -> _prescene.Frame:
        return next(self._inner)

    def __enter__(self) -> "Replay":
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        traceback: Optional[TracebackType],
    ) -> None:
        self.close()


def replay(
    recording: PathLike,
    scene: Optional[PathLike] = None,
    *,
    seed: Optional[int] = None,
    begin: float = 0.0,
    end: float = math.inf,
    salvage: bool = False,
    learned: Optional[PathLike] = None,
    depth_scale: float = 0.001,
    frame_rate: float = 30.0,
    threads: int = 0,
) -> Replay:
    """Tracks a recording: MCAP or .db3 file, folder of rosbag2, or folder of images.

    scene: a scene file; default: the one that the recording holds.
    seed: default: the one that the recording was made with, which repeats its bits, else 1.
    begin, end: seconds after the recording's first message; the belief begins anew at `begin`.
    salvage: read what is sound of a damaged recording, rather than refusing it; `summary["loss"]` says what was left out.
    learned: a learned file to begin with.
    depth_scale, frame_rate: of a folder of images: metres per unit of its depth images, frames a second.

    The same recording, scene and seed give the same bits as `prescene replay`.
    """
    return Replay(
        _prescene.Replay(
            recording=os.fspath(recording),
            scene=None if scene is None else os.fspath(scene),
            seed=None if seed is None else check_seed(seed),
            begin=begin,
            end=end,
            salvage=salvage,
            depth_scale=depth_scale,
            frame_rate=frame_rate,
            learned="" if learned is None else os.fspath(learned),
            threads=threads,
        )
    )
