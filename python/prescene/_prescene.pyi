# SPDX-License-Identifier: Apache-2.0
# The compiled part of the package, for type checkers and for reading. Arrays are numpy's; all that are given out are
# read-only, but for the answers of collision queries.
from os import PathLike
from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

class Uncertain:
    """A number that is known exactly (low == high) or as a distribution. float() is its mean."""

    @property
    def mean(self) -> float: ...
    @property
    def standard_deviation(self) -> float: ...
    @property
    def low(self) -> float:
        """The least that is possible; -inf of a normal distribution that is not cut."""
    @property
    def high(self) -> float: ...
    def __float__(self) -> float: ...

class SceneMesh:
    """Triangles in metres, in the frame of what they belong to."""

    @property
    def vertices(self) -> NDArray[np.float64]:
        """(n, 3) m. A view of the scene's own memory, which it keeps."""
    @property
    def faces(self) -> NDArray[np.uint32]:
        """(m, 3), counter-clockwise seen from outside. A view, too."""

class Model:
    """A kind of object. O is the frame of its mesh."""

    @property
    def name(self) -> str: ...
    @property
    def mass(self) -> Uncertain:
        """kg"""
    @property
    def friction(self) -> Uncertain:
        """Coulomb coefficient; that of a contact is the product of both bodies'."""
    @property
    def impact_friction(self) -> Uncertain:
        """The same while a contact closes fast."""
    @property
    def restitution(self) -> Uncertain:
        """Of one contact, in [0, 1]; that of a contact is the product of both bodies'."""
    @property
    def rolling_friction(self) -> float:
        """Lever arm, m."""
    @property
    def edge_radius(self) -> float:
        """m"""
    @property
    def center_of_mass(self) -> NDArray[np.float64]:
        """(3,) m, in O: its mean."""
    @property
    def unit_inertia(self) -> NDArray[np.float64]:
        """(3, 3) m^2: about the centre of mass, along O's axes, for a mass of 1 kg."""
    @property
    def color(self) -> Tuple[float, float, float]:
        """Red, green, blue in [0, 1]."""
    @property
    def surface(self) -> str:
        """One of opaque, transparent and mirror."""
    @property
    def visual(self) -> Optional[SceneMesh]:
        """What the camera sees, in O."""
    def collision_mesh(self) -> SceneMesh:
        """All shapes that collide, in O; made anew by each call."""

class Support:
    """A fixed thing: a table, a bin. S is its frame."""

    @property
    def name(self) -> str: ...
    @property
    def X_WS(self) -> NDArray[np.float64]:
        """Its pose in the world, (4, 4)."""
    @property
    def friction(self) -> Uncertain: ...
    @property
    def restitution(self) -> Uncertain: ...
    @property
    def color(self) -> Tuple[float, float, float]: ...
    @property
    def visual(self) -> Optional[SceneMesh]: ...
    def collision_mesh(self) -> SceneMesh:
        """In S."""

class RobotBody:
    """A body of the robot that follows a timeline. G is its frame."""

    @property
    def name(self) -> str: ...
    @property
    def times(self) -> NDArray[np.float64]:
        """(k,) s since the scene's start, ascending."""
    @property
    def X_WG(self) -> NDArray[np.float64]:
        """Its poses at these times, (k, 4, 4)."""
    @property
    def color(self) -> Tuple[float, float, float]: ...
    @property
    def visual(self) -> Optional[SceneMesh]: ...
    def collision_mesh(self) -> SceneMesh:
        """In G."""

class Camera:
    """A pinhole camera. C is its optical frame: x right, y down, z forward."""

    @property
    def name(self) -> str: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def K(self) -> NDArray[np.float64]:
        """(3, 3): focal lengths and principal point in pixels; the centre of the top-left pixel is (0, 0)."""
    @property
    def X_WC(self) -> NDArray[np.float64]:
        """The identity where is_placed is False."""
    @property
    def is_placed(self) -> bool:
        """Whether the scene says where it is."""

class SceneObject:
    """An object of a scene, and what is known of its start."""

    @property
    def name(self) -> str: ...
    @property
    def model(self) -> Model: ...
    @property
    def X_WO(self) -> NDArray[np.float64]:
        """The mean of its pose, (4, 4)."""
    @property
    def covariance(self) -> NDArray[np.float64]:
        """Of its pose, (6, 6): rotation in O (rad), then translation in W (m)."""
    @property
    def twist(self) -> NDArray[np.float64]:
        """Mean, (6,): angular (rad/s), then linear velocity of O's origin (m/s), in W."""
    @property
    def held_by(self) -> Optional[str]:
        """The robot body that holds it."""

class Scene:
    """What is fixed, what may move, who acts, and what is asked about it. Never changes."""

    @staticmethod
    def from_file(path: Union[str, bytes, PathLike[str]]) -> Scene: ...
    @staticmethod
    def from_yaml(text: str, path: Union[str, bytes, PathLike[str]] = "scene.yaml") -> Scene:
        """From the text of a scene file. `path` is its name in messages and where relative paths start."""
    @property
    def name(self) -> str: ...
    @property
    def models(self) -> Tuple[Model, ...]: ...
    @property
    def supports(self) -> Tuple[Support, ...]: ...
    @property
    def robot(self) -> Tuple[RobotBody, ...]: ...
    @property
    def objects(self) -> Tuple[SceneObject, ...]: ...
    @property
    def camera(self) -> Optional[Camera]:
        """The first of cameras."""
    @property
    def cameras(self) -> Tuple[Camera, ...]: ...
    @property
    def gravity_W(self) -> NDArray[np.float64]:
        """(3,) m/s^2"""
    @property
    def duration(self) -> float:
        """Longest simulated time, s."""
    @property
    def step(self) -> Optional[float]:
        """Of the simulation, s; None = by the size of the smallest object."""
    def object(self, name: str) -> SceneObject:
        """Raises InputError where there is none of that name."""
    def support(self, name: str) -> Support: ...

class Parameter:
    """A physical parameter as it is believed to be. float() is its mean."""

    @property
    def name(self) -> str: ...
    @property
    def mean(self) -> float: ...
    @property
    def standard_deviation(self) -> float: ...
    @property
    def low(self) -> float:
        """5 % of the belief lie below."""
    @property
    def high(self) -> float:
        """5 % of the belief lie above."""
    def __float__(self) -> float: ...

class TrackedObject:
    """What is believed of an object at a frame."""

    @property
    def name(self) -> str: ...
    @property
    def model(self) -> str: ...
    @property
    def state(self) -> str:
        """One of tracked, doubtful, unseen and lost."""
    @property
    def confidence(self) -> float:
        """Probability that it exists and is within 2 cm and 15 degrees of X_WO."""
    @property
    def existence(self) -> float:
        """Probability that there is such an object at all."""
    @property
    def X_WO(self) -> NDArray[np.float64]:
        """Mean of its pose, (4, 4)."""
    @property
    def covariance(self) -> NDArray[np.float64]:
        """Of its pose, (6, 6): rotation in O (rad), then translation in W (m)."""
    @property
    def twist(self) -> NDArray[np.float64]:
        """(6,): angular (rad/s), then linear velocity of O's origin (m/s), in W."""
    @property
    def evidence_per_pixel(self) -> float:
        """Nats per visible pixel in favour of the pose."""
    @property
    def visible_share(self) -> float:
        """Share of its pixels that nothing hid."""
    @property
    def parameters(self) -> Dict[str, Parameter]:
        """Those that its model leaves open, by their names."""
    @property
    def lessons(self) -> int:
        """Pieces of evidence that the parameters were learned from; 0 = they are the priors."""
    @property
    def learned_ns(self) -> int:
        """Stamp of the last of them, ns."""
    @property
    def is_new(self) -> bool:
        """Whether the scene does not name it: it was found."""

class Frame:
    """The belief after one camera frame. Never changes."""

    @property
    def step(self) -> int: ...
    @property
    def stamp_ns(self) -> int:
        """Of the camera frame, ns."""
    @property
    def time(self) -> float:
        """Seconds since the first frame, by the stamps."""
    @property
    def belief_hash(self) -> str:
        """Of all bits of the belief."""
    @property
    def degraded(self) -> List[str]:
        """What could not be done fully in this step."""
    @property
    def skipped(self) -> int:
        """Frames that were not used since the step before."""
    @property
    def X_WC(self) -> NDArray[np.float64]:
        """Of the camera that took the frame, (4, 4)."""
    @property
    def camera(self) -> int:
        """Which of the scene's cameras took the frame."""
    @property
    def objects(self) -> Tuple[TrackedObject, ...]: ...
    def object(self, name: str) -> TrackedObject:
        """Raises InputError where there is none of that name."""
    @property
    def depth(self) -> Optional[NDArray[np.float32]]:
        """(height, width) m; 0 = no measurement. A view, without a copy."""
    @property
    def color(self) -> Optional[NDArray[np.uint8]]:
        """(height, width, 3); None = there is none. A view, without a copy."""
    def ask_json(self, question: str, threads: int, stepper: str) -> str:
        """Use prescene.ask."""

class Replay:
    """Use prescene.replay."""

    def __init__(
        self,
        recording: Union[str, bytes, PathLike[str]],
        scene: Optional[Union[str, bytes, PathLike[str]]],
        seed: Optional[int],
        begin: float,
        end: float,
        salvage: bool,
        depth_scale: float,
        frame_rate: float,
        learned: str,
        threads: int,
    ) -> None: ...
    def __iter__(self) -> Replay: ...
    def __next__(self) -> Frame: ...
    def close(self) -> None: ...
    @property
    def scene(self) -> Scene: ...
    @property
    def seed(self) -> int: ...
    @property
    def learned(self) -> str: ...
    @property
    def summary_json(self) -> str: ...

class CollisionMesh:
    """Use prescene.collision.Mesh."""

    def __init__(self, vertices: ArrayLike, faces: ArrayLike, name: str) -> None: ...
    @property
    def vertices(self) -> NDArray[np.float32]: ...
    @property
    def faces(self) -> NDArray[np.uint32]: ...
    @property
    def name(self) -> str: ...
    @property
    def size(self) -> float: ...
    @property
    def report(self) -> str: ...
    def collides(self, other: CollisionMesh, X_AB: ArrayLike) -> Any: ...
    def closest_points(self, other: CollisionMesh, X_AB: ArrayLike, limit: float) -> Tuple[Any, ...]: ...
    def penetrations(self, other: CollisionMesh, X_AB: ArrayLike) -> Tuple[Any, ...]: ...
    def cast_rays(self, origins: ArrayLike, directions: ArrayLike, t_min: float, t_max: float) -> Tuple[Any, ...]: ...
    def nearest_points(self, points: ArrayLike, limit: float) -> Tuple[Any, ...]: ...
    def winding_numbers(self, points: ArrayLike) -> NDArray[np.int32]: ...

def ask_scene(scene: Scene, question: str, seed: int, threads: int, stepper: str) -> str:
    """Use prescene.ask."""
