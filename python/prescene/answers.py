# SPDX-License-Identifier: Apache-2.0
"""A prediction as values; `json` has the rest of it."""

from __future__ import annotations

from typing import Any, Dict, Iterator, List, NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .poses import matrix

__all__ = ["FinalPoseComponent", "FinalPoses", "HeatMap", "Outcome", "Prediction"]


class Outcome(NamedTuple):
    """How probable an outcome is."""

    name: str
    group: str  #: Of exclusive outcomes; "" = none.
    probability: float
    low: float  #: Interval of the probability, at the confidence that was asked for.
    high: float


class FinalPoseComponent(NamedTuple):
    """A Gaussian on poses in which an object ends, within one outcome and one resting face."""

    weight: float
    outcome: str
    X_WO: NDArray[np.float64]  #: Mean, homogeneous matrix (4, 4), m: of the object's frame in the world.
    covariance: NDArray[np.float64]  #: (6, 6): rotation in the object's frame (rad), then translation in the world's (m).


class HeatMap(NamedTuple):
    """The probability that an object ends in each cell of a grid in the world's xy plane."""

    mass: NDArray[np.float64]  #: (ny, nx); sums to one.
    x0: float  #: m: where cell (0, 0) begins.
    y0: float
    cell: float  #: Edge of a cell, m.


class FinalPoses:
    """Where one object ends."""

    def __init__(self, json: Dict[str, Any]) -> None:
        self.json = json  #: As docs/reference/queries.md describes it.

    @property
    def object(self) -> str:
        return str(self.json["object"])

    @property
    def mean_position(self) -> NDArray[np.float64]:
        """(3,) m, in the world."""
        return np.asarray(self.json["mean_position"], dtype=np.float64)

    @property
    def position_covariance(self) -> NDArray[np.float64]:
        """(3, 3) m^2."""
        return np.asarray(self.json["position_covariance"], dtype=np.float64).reshape(3, 3)

    @property
    def components(self) -> List[FinalPoseComponent]:
        return [
            FinalPoseComponent(
                float(one["weight"]),
                str(one["outcome"]),
                matrix(one["mean"]),
                np.asarray(one["covariance"], dtype=np.float64).reshape(6, 6),
            )
            for one in self.json["components"]
        ]

    @property
    def heat_map(self) -> HeatMap:
        grid = self.json["heat_map"]
        mass = np.asarray(grid["mass"], dtype=np.float64).reshape(int(grid["ny"]), int(grid["nx"]))
        return HeatMap(mass, float(grid["x0"]), float(grid["y0"]), float(grid["cell"]))

    def __repr__(self) -> str:
        x, y, z = self.mean_position
        return f"<FinalPoses of '{self.object}' about ({x:.3f}, {y:.3f}, {z:.3f}) m>"


class Prediction:
    """The answer to a prediction. `prediction["in_bin"]` is an outcome; so is `prediction["where.in_bin"]`."""

    def __init__(self, json: Dict[str, Any]) -> None:
        #: The document that `prescene predict --json` prints; of a frame it has "belief_step" for "scene" and "seed".
        self.json = json

    @property
    def outcomes(self) -> Tuple[Outcome, ...]:
        return tuple(
            Outcome(one["name"], one.get("group", ""), one["probability"], *one["interval"])
            for one in self.json["outcomes"]
        )

    @property
    def final_poses(self) -> Tuple[FinalPoses, ...]:
        """Of the objects that outcomes judge or actions move; empty with `outcomes_only`."""
        return tuple(FinalPoses(one) for one in self.json.get("final_poses", ()))

    @property
    def remarks(self) -> Tuple[str, ...]:
        """What one should know before trusting the numbers."""
        return tuple(self.json.get("remarks", ()))

    @property
    def instances(self) -> int:
        """Simulated runs that the probabilities are shares of."""
        return int(self.json["instances"])

    @property
    def converged(self) -> bool:
        """Whether every interval reached the half width that was asked for."""
        return bool(self.json["converged"])

    def __getitem__(self, name: str) -> Outcome:
        found = [one for one in self.outcomes if name in (one.name, f"{one.group}.{one.name}")]
        if len(found) == 1:
            return found[0]
        full = [f"{one.group}.{one.name}" if one.group else one.name for one in self.outcomes]
        if found:
            raise InputError(f"outcome '{name}' stands for several: give one of {', '.join(full)}", "not_found")
        raise InputError(f"there is no outcome '{name}': there are {', '.join(full)}", "not_found")

    def __iter__(self) -> Iterator[Outcome]:
        return iter(self.outcomes)

    def __len__(self) -> int:
        return len(self.outcomes)

    def __repr__(self) -> str:
        text = ", ".join(f"{one.name} {one.probability:.3f}" for one in self.outcomes)
        return f"<Prediction from {self.instances} instances: {text}>"
