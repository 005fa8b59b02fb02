# SPDX-License-Identifier: Apache-2.0
"""Questions about a scene or a frame, in the words of docs/reference/queries.md."""

from __future__ import annotations

import json
from typing import Any, Dict, List, Mapping, Optional, Sequence, Union

import numpy as np

from . import _prescene
from .answers import Prediction
from .errors import InputError

__all__ = ["ask", "predict"]

# What `prescene predict --json` works out.
_FULL_DETAIL = ("final_poses", "typical_runs", "inputs", "contacts")


def _json_value(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no form in JSON: give numbers, texts, lists and dicts")


def _text(question: Union[str, Mapping[str, Any]]) -> str:
    if isinstance(question, str):
        return question
    if not isinstance(question, Mapping):
        raise TypeError(f"question: a dict or a text in JSON is needed, not {type(question).__name__}")
    try:
        return json.dumps(question, default=_json_value, allow_nan=False)
    except (ValueError, RecursionError) as error:  # a number that is not finite, a dict within itself
        raise InputError(f"question: {error}: give finite numbers") from None


def check_seed(seed: int) -> int:
    """The seed, or InputError."""
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)):
        raise TypeError(f"seed: a whole number is needed, not {type(seed).__name__}")
    if not 0 <= int(seed) < 2**64:
        raise InputError(f"seed: {seed} is out of range: give a whole number from 0 to {2**64 - 1}")
    return int(seed)


def ask(
    about: Union[_prescene.Scene, _prescene.Frame],
    question: Union[str, Mapping[str, Any]],
    *,
    seed: Optional[int] = None,
    threads: int = 0,
    stepper: str = "automatic",
) -> Dict[str, Any]:
    """Asks anything that can be asked over the bus: {"where": {}}, {"predict": ...}, "stability", "achieve", "view",
    "next_view".

    `about` is a scene, whose distributions are then the start, or a frame of a replay, whose belief is. `seed` (default
    1) is for scenes only: a frame has its replay's. Returns the answer as docs/reference/queries.md describes it.
    Raises InputError for what can't be asked or answered.
    """
    text = _text(question)
    if isinstance(about, _prescene.Frame):
        if seed is not None:
            raise InputError("seed: a frame has the seed of its replay: give it to prescene.replay")
        answer = about.ask_json(text, threads=threads, stepper=stepper)
    elif isinstance(about, _prescene.Scene):
        seed = 1 if seed is None else check_seed(seed)
        answer = _prescene.ask_scene(about, text, seed=seed, threads=threads, stepper=stepper)
    else:
        raise TypeError(f"about: a Scene or a Frame is needed, not {type(about).__name__}")
    result: Dict[str, Any] = json.loads(answer)
    return result


def predict(
    about: Union[_prescene.Scene, _prescene.Frame],
    *,
    seed: Optional[int] = None,
    half_width: float = 0.02,
    confidence: float = 0.95,
    max_instances: int = 4096,
    max_seconds: Optional[float] = None,
    duration: Optional[float] = None,
    actions: Optional[Sequence[Mapping[str, Any]]] = None,
    outcomes: Any = None,
    exclusive_outcomes: Any = None,
    outcomes_only: bool = False,
    model_error: bool = False,
    paths: int = 0,
    threads: int = 0,
    stepper: str = "automatic",
) -> Prediction:
    """What happens in a scene, or from a frame on: probabilities with intervals, and where things end.

    half_width: of the intervals of the probabilities, at which to stop; `confidence` is that of the intervals.
    max_seconds: wall time (s) after which no more instances begin; the answer then depends on the machine's speed, and
        leaves out what takes further instances.
    duration: longest simulated time (s); default: the scene's.
    actions, outcomes, exclusive_outcomes: in the place of the scene's, with the keys of scene files.
    outcomes_only: probabilities alone, which is faster, because each instance ends once its outcome is known.
    model_error: also what half and double steps and the ends of uncertain parameters change.
    paths: so many instances' ways.
    threads: 0 = all of the machine; does not change the answer.

    The same scene, seed and arguments give the same bits as `prescene predict --json`, wall and processor times aside.
    """
    detail: List[str] = [] if outcomes_only else list(_FULL_DETAIL)
    if outcomes_only:
        detail.append("inputs")
    if max_seconds is None or model_error:
        detail.append("chaos")
    if model_error:
        detail.append("model_error")
    effort: Dict[str, Any] = {"tolerance": half_width, "confidence": confidence, "max_instances": max_instances}
    question: Dict[str, Any] = {"effort": effort, "detail": detail}
    if max_seconds is not None:
        effort["max_seconds"] = max_seconds
    for key, value in (
        ("duration", duration),
        ("actions", actions),
        ("outcomes", outcomes),
        ("exclusive_outcomes", exclusive_outcomes),
    ):
        if value is not None:
            question[key] = value
    if paths:
        question["paths"] = paths
    answer = ask(about, {"predict": question}, seed=seed, threads=threads, stepper=stepper)
    document: Dict[str, Any] = {}
    if isinstance(about, _prescene.Scene):
        document = {"scene": about.name, "seed": 1 if seed is None else int(seed)}
    else:
        document = {"belief_step": answer["step"]}
    document.update(answer["predict"])
    return Prediction(document)
