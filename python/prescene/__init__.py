# SPDX-License-Identifier: Apache-2.0
"""Tracks known objects with an RGB-D camera and predicts, with probabilities, what happens next.

    scene = prescene.load_scene("scenarios/milk_on_bin.yaml")
    prediction = prescene.predict(scene, seed=1)
    print(prediction["in_bin"].probability)

docs/reference/python.md describes the package. X_WO is the pose of the object's frame O in the world W, a homogeneous
matrix (4, 4); lengths are metres, angles radians, times seconds. Warnings go to the logger "prescene".
"""

from __future__ import annotations

import os as _os
from typing import Union as _Union

from . import collision
from ._prescene import (
    Camera,
    Frame,
    Model,
    Parameter,
    RobotBody,
    Scene,
    SceneMesh,
    SceneObject,
    Support,
    TrackedObject,
    Uncertain,
    __version__,
)
from .answers import FinalPoseComponent, FinalPoses, HeatMap, Outcome, Prediction
from .errors import Error, InputError, Problem, UnavailableError
from .poses import matrix, pose
from .questions import ask, predict
from .recordings import Replay, replay

__all__ = [
    "Camera",
    "Error",
    "FinalPoseComponent",
    "FinalPoses",
    "Frame",
    "HeatMap",
    "InputError",
    "Model",
    "Outcome",
    "Parameter",
    "Prediction",
    "Problem",
    "Replay",
    "RobotBody",
    "Scene",
    "SceneMesh",
    "SceneObject",
    "Support",
    "TrackedObject",
    "UnavailableError",
    "Uncertain",
    "__version__",
    "ask",
    "collision",
    "load_scene",
    "matrix",
    "pose",
    "predict",
    "replay",
]


def load_scene(path: _Union[str, "_os.PathLike[str]"]) -> Scene:
    """Reads a scene file and the meshes that it names.

    Raises InputError with every mistake of the file, each with its line and how to mend it, as `prescene validate` says
    them. `Scene.from_yaml` reads a text.
    """
    return Scene.from_file(path)
