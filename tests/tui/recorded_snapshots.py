"""A real drive, stored as numbers, so that another CPU's rounding cannot change a picture of it."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from pdtui.core.attributes import Attribute, BehaviorAim
from pdtui.core.robot_links_and_state import Link
from pdtui.core.step_record import ActiveBehavior
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot, StimulatedUnit
from pdtui.stimulation.stimulation_map import Behavior, MotorPrimitive, PidGains, StimulationMap

ARRAYS = ("activations", "attributes", "poses", "history", "path")
ABSENT = ("scenery", "traffic", "statistics")
"""The Ant has none to show."""


def drive_map(policy: str = "ant_sac", policy_hash: str = "0" * 64) -> StimulationMap:
    """A map with every kind of behavior."""
    behaviors = [
        Behavior("forward", "w", "runs on in the direction of its first leg", {"1:7": 1.5, "1:40": -1.0}),
        Behavior("spin left", "a", "turns on the spot, against the clock", {"0:12": 2.0}, period=2.0),
        Behavior("spin right", "d", "turns on the spot, with the clock", {"0:12": -2.0}, period=2.0),
        Behavior("crouch", "c", "keeps its belly near the ground", {"1:3": 1.0}, together=("heading",)),
        Behavior(
            "heading",
            "h",
            "keeps the heading that the arrows choose",
            {"turn": 1.0},
            mode="pid",
            aim=BehaviorAim("yaw", "increase"),
            pid=PidGains("yaw", 2.0, 0.1, 0.1, 3.0, 0.1),
        ),
    ]
    return StimulationMap(
        "ant",
        policy,
        policy_hash,
        "space",
        {"turn": MotorPrimitive("turn", "yaw rate", "0:5", 0.8)},
        {behavior.name: behavior for behavior in behaviors},
        source="maps/ant.toml",
    )


def save(path: Path, facts: DriveFacts, snapshots: list[DriveSnapshot]) -> None:
    """Write a drive: arrays as they are, everything else as JSON."""
    plain = [
        {name: value for name, value in vars(snapshot).items() if name not in (*ARRAYS, *ABSENT)}
        | {
            "active": [asdict(behavior) for behavior in snapshot.active_behaviors],
            "units": [asdict(unit) for unit in snapshot.stimulated_units],
        }
        for snapshot in snapshots
    ]
    for fields in plain:
        fields["achieved"] = fields.pop("achieved_speed")
    text = json.dumps({"briefing": asdict(facts), "snapshots": plain})
    arrays: dict[str, Any] = {
        f"{name}_{index}": getattr(snapshot, name).astype(np.float16 if name == "activations" else np.float32)
        for index, snapshot in enumerate(snapshots)
        for name in ARRAYS
    }
    np.savez_compressed(path, text=np.frombuffer(text.encode(), np.uint8), **arrays)


def load(path: Path) -> tuple[DriveFacts, list[DriveSnapshot]]:
    """Read what `save` wrote."""
    with np.load(path, allow_pickle=False) as file:
        stored = json.loads(file["text"].tobytes().decode())
        facts = stored["briefing"]
        facts["attributes"] = tuple(Attribute(**fields) for fields in facts["attributes"])
        facts["links"] = tuple(_link(fields) for fields in facts["links"])
        facts["layers"] = tuple(facts["layers"])
        snapshots = []
        for index, fields in enumerate(stored["snapshots"]):
            fields["achieved_speed"] = fields.pop("achieved")
            fields["active_behaviors"] = tuple(ActiveBehavior(**view) for view in fields.pop("active"))
            fields["stimulated_units"] = tuple(StimulatedUnit(**view) for view in fields.pop("units"))
            arrays = {name: file[f"{name}_{index}"].astype(np.float64) for name in ARRAYS}
            arrays["activations"] = arrays["activations"].astype(np.float32)
            snapshots.append(DriveSnapshot(**fields, **arrays))
    return DriveFacts(**facts), snapshots


def _link(fields: dict[str, Any]) -> Link:
    tuples: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()
    }
    return Link(**tuples)
