"""The streams of a session that can be exported, with the columns of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pdtui.core.drive_edits import NAMED_EDITS, VALUED_EDITS
from pdtui.core.units import format_unit
from pdtui.robots.geometry import rotate_vectors
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.session_schema import ACTIVE_FIELDS
from pdtui.sessions.streams.step_block import StepBlock
from pdtui.sessions.viewer.link_shape_poses import box_links, round_links


class ExportColumn(NamedTuple):
    """A column of an exported table: its values, their physical unit, and what they are."""

    values: Any
    unit: str = ""
    says: str = ""


Columns = dict[str, ExportColumn]


@dataclass(frozen=True)
class ExportStream:
    """A stream that can be exported.

    Attributes:
        says: what it contains.
        columns: returns its columns in a block of control steps, with ``step`` if a step may have any number
            of rows; None for events, which do not come in blocks, and observations, which a replay computes.
        activations, poses: whether the block has to contain these.
    """

    says: str
    columns: Callable[[StepBlock, SessionHeader], Columns] | None
    activations: bool = False
    poses: bool = False


def event_columns(header: SessionHeader) -> Columns:
    """Return the columns of the events; what an event of its kind does not have is null."""
    events = header.events
    named = {"behavior", "control", *VALUED_EDITS, *NAMED_EDITS}
    valued = {"control", "rewind", *VALUED_EDITS}
    values = [event.value if event.kind in valued else None for event in events]
    return {
        "step": ExportColumn(np.array([event.step for event in events], np.int64)),
        "kind": _texts([event.kind for event in events], "what the event does"),
        "name": _texts(
            [event.name if event.kind in named else "" for event in events],
            "behavior, manual control or unit",
        ),
        "value": ExportColumn(
            pa.array(values, pa.float64()), says="target, factor, control, step, output, place or gain"
        ),
        "key": _texts([event.key for event in events], "key that the operator pressed"),
    }


def observation_columns(observations: NDArray[Any]) -> Columns:
    """Return the columns of observations, shape (n, O)."""
    says = "what the policy observed before the step"
    return _name_columns("observation", observations, says)


def _attribute_columns(block: StepBlock, header: SessionHeader) -> Columns:
    # What a world does not report in a step is NaN there.
    return {
        f"{one.name} ({one.unit})": ExportColumn(
            pa.array(block.attributes[:, row], from_pandas=True),
            one.unit,
            "angle that jumps at ±π" if one.wraps else "kinematic attribute after the step",
        )
        for row, one in enumerate(header.info.attributes)
    }


def _action_columns(block: StepBlock, _: SessionHeader) -> Columns:
    actions = block.actions_as_float32()
    says = "component of the action that the robot was given"
    return _name_columns("action", actions, says)


def _reward_columns(block: StepBlock, _: SessionHeader) -> Columns:
    steps = block.steps.tolist()
    return {
        "reward": ExportColumn(block.rewards, says="reward of the step"),
        "cost": ExportColumn(block.costs, says="cost of the step"),
        "episode": ExportColumn(block.episodes, says="number of the episode, from 0"),
        "ended": _texts(
            [block.endings.get(step, "") for step in steps], "why the episode ended with the step"
        ),
        "outcome": _texts([str(block.outcomes.get(step, "")) for step in steps], "how it ended, in one word"),
    }


def _digest_columns(block: StepBlock, _: SessionHeader) -> Columns:
    return {"digest": ExportColumn(block.digests, says="digest of the simulator's state after the step")}


def _activation_columns(block: StepBlock, header: SessionHeader) -> Columns:
    layers = header.info.layers
    assert block.activations is not None
    outputs = block.activations.astype(np.float32, copy=False)
    says = "output of the hidden unit, layer:index, as the next layer received it"
    return {
        format_unit(unit, layers): ExportColumn(outputs[:, unit], says=says) for unit in range(sum(layers))
    }


_BEHAVIOR_FIELDS = {
    "remaining": ("control steps", "until the behavior's period ends; null without a period"),
    "factor": ("", "factor of the operator on the map's magnitudes"),
    "target": ("", "target of the controller, in the attribute's unit"),
    "value": ("", "value that the controller sees, in the attribute's unit"),
    "error": ("", "target less value, in the attribute's unit"),
    "magnitude": ("", "output of the controller"),
    "waiting": ("control steps", "until an armed behavior begins, -1 if unknown"),
}


def _behavior_columns(block: StepBlock, _: SessionHeader) -> Columns:
    columns: Columns = {
        "step": ExportColumn(np.repeat(block.steps, block.behavior_counts)),
        "behavior": _texts(block.behavior_names, "name of the active behavior"),
    }
    for column, field in enumerate(ACTIVE_FIELDS):
        # NaN stands for None.
        states = pa.array(block.behavior_states[:, column], pa.float64(), from_pandas=True)
        columns[field] = ExportColumn(states, *_BEHAVIOR_FIELDS[field])
    return columns


def _unit_columns(block: StepBlock, header: SessionHeader) -> Columns:
    units = [format_unit(int(unit), header.info.layers) for unit in block.stimulated[:, 0]]
    return {
        "step": ExportColumn(np.repeat(block.steps, block.stimulated_counts)),
        "unit": _texts(units, "hidden unit, layer:index"),
        "overwritten": ExportColumn(block.stimulated[:, 1], says="output of the unit"),
        "natural": ExportColumn(block.stimulated[:, 2], says="output that it would have had"),
    }


def _takeover_columns(block: StepBlock, _: SessionHeader) -> Columns:
    rows, components = block.replaced_row_indices, block.replaced[:, 0].astype(np.int64)
    return {
        "step": ExportColumn(block.steps[rows]),
        "action": ExportColumn(components, says="component of the action"),
        "operator": ExportColumn(block.actions_as_float32()[rows, components], says="value of the operator"),
        "policy": ExportColumn(block.replaced[:, 1], says="value of the policy, which did not act"),
    }


def _pose_columns(block: StepBlock, header: SessionHeader) -> Columns:
    """Return one row per drawn step and link: the center and the orientation of its shape in the world."""
    count, links = len(block.pose_steps), header.info.links
    rounded, boxes = round_links(links), box_links(links)
    parts = []
    if rounded and count:
        turned = block.poses["Capsules3D:quaternions"][..., [3, 0, 1, 2]].astype(np.float64)
        half = np.zeros((len(rounded), 3))
        half[:, 2] = [link.size[1] if link.shape == "capsule" else 0.0 for link in rounded]
        # The viewer's capsule starts at its translation and extends along z.
        centers = block.poses["Capsules3D:translations"] + rotate_vectors(turned, half)
        parts.append(np.concatenate([centers, turned], axis=-1))
    if boxes and count:
        turned = block.poses["Boxes3D:quaternions"][..., [3, 0, 1, 2]].astype(np.float64)
        parts.append(np.concatenate([block.poses["Boxes3D:centers"], turned], axis=-1))
    poses = np.concatenate(parts, axis=1).reshape(-1, 7) if parts else np.empty((0, 7))
    names = [link.name for link in (*rounded, *boxes)] * (count if parts else 0)
    columns = {
        "step": ExportColumn(np.repeat(block.pose_steps, len(links) if parts else 0)),
        "link": _texts(names, "link of the robot"),
    }
    for column, name in enumerate(("x", "y", "z", "qw", "qx", "qy", "qz")):
        unit, says = ("m", "center of its shape") if column < 3 else ("", "orientation, a unit quaternion")
        columns[name] = ExportColumn(poses[:, column].astype(np.float32), unit, says)
    return columns


def _name_columns(name: str, values: NDArray[Any], says: str) -> Columns:
    return {f"{name} {row}": ExportColumn(values[:, row], says=says) for row in range(values.shape[1])}


def _texts(values: Any, says: str) -> ExportColumn:
    """Return texts of which empty ones are null."""
    return ExportColumn(pa.array([value or None for value in values], pa.utf8()), says=says)


STREAMS: dict[str, ExportStream] = {
    "attributes": ExportStream("kinematic attributes after each step", _attribute_columns),
    "actions": ExportStream("what the policy, or during a takeover the operator, commanded", _action_columns),
    "gains": ExportStream("reward, cost, episode, and why and how it ended", _reward_columns),
    "digests": ExportStream("digest of the simulator's state after each step", _digest_columns),
    "activations": ExportStream(
        "output of every hidden unit, as the next layer received it", _activation_columns, activations=True
    ),
    "behaviors": ExportStream("active behaviors with their controllers, one row each", _behavior_columns),
    "stimulation": ExportStream(
        "stimulated units, with natural and overwritten outputs, one row each", _unit_columns
    ),
    "takeover": ExportStream(
        "components of the action that the operator set, with the policy's own value, one row each",
        _takeover_columns,
    ),
    "poses": ExportStream(
        "links of the robot where the viewer draws them, one row each", _pose_columns, poses=True
    ),
    "observations": ExportStream("what the policy observed, computed again by a replay", None),
    "events": ExportStream("everything that changed the run, one row per event", None),
}
"""The streams by name."""
