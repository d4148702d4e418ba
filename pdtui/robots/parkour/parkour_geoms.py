"""A parkour course in MuJoCo: boxes of the world that are moved to where the obstacles are."""

from __future__ import annotations

import mujoco
import numpy as np

from pdtui.core.attributes import Floats

_NAME = "parkour box"
_COUNT = 24
# What a geom of the robot has in its contype that these boxes can touch; the ground has another one.
_AFFINITY = 2
_OUT_OF_THE_WAY = -10.0  # height of a box that is not used, m


def add_parkour_geoms(spec: mujoco.MjSpec) -> None:
    """Add boxes that touch nothing until `place_parkour_boxes` puts them somewhere."""
    for number in range(_COUNT):
        spec.worldbody.add_geom(
            name=f"{_NAME} {number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[1.0, 1.0, 1.0],
            pos=[0.0, 0.0, _OUT_OF_THE_WAY],
            contype=0,
            conaffinity=0,
            friction=spec.geom("floor").friction,
        )


def place_parkour_boxes(model: mujoco.MjModel, boxes: Floats) -> None:
    """Put boxes in the robot's way: middles x y z and sizes along x y z, m, shape (N, 6)."""
    geoms = _geom_range(model)
    count = len(boxes)
    model.geom_conaffinity[geoms] = 0
    model.geom_pos[geoms] = 0.0, 0.0, _OUT_OF_THE_WAY
    used = geoms[:count]
    model.geom_conaffinity[used] = _AFFINITY
    model.geom_pos[used], model.geom_size[used] = boxes[:, :3], boxes[:, 3:] / 2
    model.geom_rbound[used] = np.linalg.norm(boxes[:, 3:] / 2, axis=1)
    # MuJoCo's search for contacts within a body relies on where its geoms were when the model was compiled.
    midphase = int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)
    model.opt.disableflags = (model.opt.disableflags & ~midphase) | (midphase if count else 0)


def touches_parkour_box(model: mujoco.MjModel, data: mujoco.MjData, geom: str) -> bool:
    """Return whether a geom of the robot touches one of the boxes."""
    geoms, its = _geom_range(model), model.geom(geom).id
    pairs = data.contact.geom
    box = (pairs >= geoms[0]) & (pairs <= geoms[-1])
    return bool((box.any(axis=1) & (pairs == its).any(axis=1)).any())


def _geom_range(model: mujoco.MjModel) -> np.ndarray:
    first: int = model.geom(f"{_NAME} 0").id
    return np.arange(first, first + _COUNT)
