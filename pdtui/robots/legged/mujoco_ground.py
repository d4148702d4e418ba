"""Rough ground in MuJoCo: a height field in the model of a legged robot, filled anew for every world."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco

from pdtui.robots.legged.terrain import RoughGround

_NAME = "rough ground"
# Thickness of the ground under its lowest point, m.
_THICKNESS = 0.1


def load_legged_model(
    path: Path, rough: RoughGround | None, add_more: Callable[[mujoco.MjSpec], None] = lambda _: None
) -> mujoco.MjModel:
    """Return the model of a file, with rough ground of the size of `rough` added, if there is any.

    The ground is added level and without effect; `lay_rough_ground` changes that. `add_more` adds more.
    """
    if rough is None:
        return mujoco.MjModel.from_xml_path(str(path))
    spec = mujoco.MjSpec.from_file(str(path))
    rows, columns = rough.heights.shape
    (x, y), (width, depth) = rough.corner, rough.extent
    spec.add_hfield(
        name=_NAME,
        ncol=rows,
        nrow=columns,
        size=[width / 2, depth / 2, 1.0, _THICKNESS],
        userdata=[0.0] * rough.heights.size,
    )
    floor = spec.geom("floor")
    spec.worldbody.add_geom(
        name=_NAME,
        type=mujoco.mjtGeom.mjGEOM_HFIELD,
        hfieldname=_NAME,
        pos=[x + width / 2, y + depth / 2, 0.0],
        contype=0,
        conaffinity=0,
        friction=floor.friction,
        rgba=floor.rgba,
    )
    add_more(spec)
    return spec.compile()


def lay_rough_ground(model: mujoco.MjModel, rough: RoughGround | None) -> None:
    """Fill the ground of a model that `load_legged_model` returned; without any, the floor is level."""
    geom = model.geom(_NAME)
    geom.conaffinity[0] = 0 if rough is None else int(model.geom("floor").conaffinity[0])
    # The height field has a size of 1 m upward, and one row for every y.
    model.hfield_data[:] = 0.0 if rough is None else rough.heights.T.ravel()
