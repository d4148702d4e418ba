"""The Python API: load a policy, dissect it, drive it, and replay a session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from torch import nn

from pdtui.core.calling.dataclass_fields import takes_fields_of
from pdtui.core.console.progress_bar import progress_bar
from pdtui.dissection.dissect import dissect as run_dissection
from pdtui.dissection.dissection_config import QUICK_DISSECTION, DissectionConfig, DissectionSettings
from pdtui.dissection.dissection_result import Dissection
from pdtui.driving.drive_arrays import DriveArrays, collect_drive_arrays
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.keystrokes import read_keystrokes
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.replays.replay_result import ReplayResult
from pdtui.driving.session_replay import replay_session
from pdtui.policies.runtime.action_decoders import Decoder
from pdtui.policies.runtime.live_network import policy_from_network
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.torchscript import build_torchscript
from pdtui.policies.weights import policy_loading
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions, ObservationActionSpaces
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.robots import RobotSpec, open_robot
from pdtui.robots.robot import Robot
from pdtui.sessions.writer.session_file import ExistingFile
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.choosing.drive_map import choose_drive_map
from pdtui.stimulation.map_robot_options import combine_map_and_robot
from pdtui.stimulation.stimulation_map import StimulationMap

__all__ = [
    "QUICK_DISSECTION",
    "Dissection",
    "DissectionSettings",
    "DriveArrays",
    "ImportOptions",
    "Policy",
    "RobotSpec",
    "dissect",
    "drive",
    "load_policy",
    "replay",
]


def load_policy(
    policy: str | Path | nn.Module,
    robot: str | RobotSpec | Robot | None = None,
    *,
    import_options: ImportOptions = NO_OPTIONS,
    observations: int | Sequence[int] | None = None,
    hidden: Sequence[str] | None = None,
    decode: Decoder | None = None,
    batched: bool | None = None,
    initial_state: Any = None,
    name: str = "",
) -> Policy:
    """Load a policy whose hidden units can be read and overwritten, from a file or a network in memory.

    >>> import numpy as np, pdtui
    >>> policy = pdtui.load_policy("ant")
    >>> list(policy.layers)
    [256, 256]
    >>> step = policy.act(np.zeros(27))
    >>> step.action.shape, step.activations.shape
    ((8,), (512,))

    A network in memory needs the robot that it drives, or the shape of its observation:

    >>> from torch import nn
    >>> network = nn.Sequential(nn.Linear(27, 16), nn.Tanh(), nn.Linear(16, 8))
    >>> pdtui.load_policy(network, "ant").layers
    (16,)

    Args:
        policy: A weights file, the name of a shipped policy, a TorchScript file, which is read as data (see
            `pdtui.policies.torchscript`), or a `torch.nn.Module`, which is copied.
        robot: The robot that the policy drives; it gives shapes and bounds that a file may lack.
        import_options: Answers to what the weights file does not state; see `pdtui.policies.importers`.
        observations, hidden, decode, batched, initial_state, name: For a network in memory or a TorchScript
            file; see `pdtui.policies.runtime.live_network.policy_from_network`.

    Raises:
        PdtuiError: The policy cannot be loaded, or is for another robot.
    """
    sha256, found = "", None
    if not isinstance(policy, nn.Module):
        found = policy_loading.read_policy_of_another_program(path := find_weights_file(str(policy)))
        if found is not None and found.form == "torchscript":
            policy, name, sha256 = build_torchscript(found), name or path.stem, found.sha256
    with nullcontext() if robot is None else open_robot(robot) as world:
        if not isinstance(policy, nn.Module):
            of = None if world is None else world.name
            spaces = None if world is None else ObservationActionSpaces.of_world(world)
            return policy_loading.load_policy(
                policy, of, import_options=import_options, spaces=spaces, found=found
            )
        return policy_from_network(
            policy,
            None if world is None else world.observation_space,
            None if world is None else world.action_space,
            observations=observations,
            hidden=hidden,
            decode=decode,
            batched=batched,
            initial_state=initial_state,
            name=name,
            sha256=sha256,
        )


@takes_fields_of(DissectionConfig)
def dissect(config: DissectionConfig) -> Dissection:
    """Find out which hidden units move what: monitor, match, probe, and search for behaviors.

    The arguments are the fields of `pdtui.dissection.dissection_config.DissectionConfig`. `workers` processes
    (or those of a `pdtui.core.cluster.ray_cluster.RayCluster`) load a robot and a policy given by name; an
    object stays in this process. A notebook shows a table; `Dissection.to_pandas` gives a data frame.

    >>> import dataclasses, pdtui
    >>> from torch import nn
    >>> network = nn.Sequential(nn.Linear(27, 4), nn.Tanh(), nn.Linear(4, 8))
    >>> _ = nn.init.constant_(network[2].weight, 0.01)
    >>> quick = dataclasses.replace(pdtui.QUICK_DISSECTION.shortened_to(40), controls=4, mover_steps=10)
    >>> found = pdtui.dissect("ant", network, episodes=1, settings=quick, budget_minutes=0.0)
    >>> found.screen.effects.shape[0], found.matching.discrepancy.shape[1]  # a row, a column for each unit
    (4, 4)
    >>> found.to_map().robot
    'ant'

    Raises:
        PdtuiError: What is wrong with the robot, the policy, or the map to start from.
    """
    with progress_bar("dissecting", quiet=config.progress is not True) as advance:
        if advance is not None:
            bar = advance
            config = replace(config, progress=lambda stage, done, total: bar(done, total, stage))
        return run_dissection(config)


def drive(
    robot: str | RobotSpec | Robot,
    stimulation_map: str | Path | StimulationMap | None = None,
    *,
    policy: str | Path | nn.Module | Policy | None = None,
    import_options: ImportOptions = NO_OPTIONS,
    keys: Mapping[int, str | Sequence[str]] | str | Path | None = None,
    steps: int = 1000,
    seed: int = 0,
    stochastic: bool = False,
    start: str = "",
    record: str | Path | None = None,
    overwrite: bool = False,
    force: bool = False,
    minutes: float | None = None,
    progress: bool = False,
) -> DriveArrays:
    """Drive without a screen, as fast as the machine allows.

    A notebook shows the result as curves; `DriveArrays.to_pandas` gives a data frame.

    >>> import pdtui
    >>> drive = pdtui.drive("ant", keys={50: "x"}, steps=150)
    >>> drive
    <Drive of ant by ant: 150 steps (7.5 s), 1 events, falls 0>
    >>> bool(drive["speed"][-20:].mean() < drive["speed"][30:50].mean())
    True

    A policy without a map drives alone, on any environment of Gymnasium, too:

    >>> from torch import nn
    >>> network = nn.Sequential(nn.Linear(11, 8), nn.Tanh(), nn.Linear(8, 3))
    >>> len(pdtui.drive("Hopper-v5", policy=network, steps=20))
    20

    Args:
        robot: The robot's name, its name with options, which override the map's, or a `Robot`.
        stimulation_map: A map, or its name or file. By default, the map that has the robot's name, if it is
            for this policy; otherwise the policy drives alone.
        policy: The policy to use instead of the map's. If a map is named, a network in memory has to be its
            own.
        import_options: Answers to what the weights file does not state, in preference to the map's.
        keys: One key or several for each control step before which they are pressed; or a keystroke file.
        steps: Control steps.
        seed: Seed of the reset and of every random number.
        stochastic: Draw actions from the policy's distribution instead of taking its mean.
        start: State in which episodes start, for a robot with several.
        record: File of a new session.
        overwrite: Replace that file, if it exists, once the new session is whole.
        force: Drive even if the map was made for another policy.
        minutes: Time after which the drive ends with the steps done so far.
        progress: Show a progress bar on standard error.

    Raises:
        PdtuiError: Robot, map or policy cannot be loaded or do not fit each other, or a key means nothing.
    """
    name = robot if isinstance(robot, str) else robot.name
    stimulation_map = choose_drive_map(name, stimulation_map, policy, import_options, force=force)
    stimulation_map, robot = combine_map_and_robot(stimulation_map, robot)
    config = DriveConfig(name, stimulation_map, seed, stochastic=stochastic, start=start, force=force)
    with open_robot(robot) as world:
        loop = build_control_loop(config, world, None if isinstance(policy, str | Path) else policy)
        presses = read_keystrokes(Path(keys), stimulation_map) if isinstance(keys, str | Path) else keys or {}
        existing: ExistingFile = "replace" if overwrite else "refuse"
        recorder = None if record is None else SessionRecorder(Path(record), loop.info, existing=existing)
        with progress_bar("driving", quiet=not progress) as advance:
            return collect_drive_arrays(loop, presses, steps, recorder, progress=advance, minutes=minutes)


def replay(
    session: str | Path,
    *,
    robot: Robot | None = None,
    policy: str | Path | nn.Module | Policy | None = None,
    minutes: float | None = None,
    progress: bool = False,
    **judging: Any,
) -> ReplayResult:
    """Run a session again and compare every step.

    >>> import pdtui, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = pdtui.drive("ant", keys={10: "x"}, steps=30, record=f"{folder}/walk.rrd")
    ...     print(pdtui.replay(f"{folder}/walk.rrd").first_difference)
    None

    Args:
        session: File of the session.
        robot: The robot, if the session's cannot be built from its name.
        policy: The policy, if the session's is not where its map says.
        minutes: Time after which the replay ends with the steps compared so far.
        progress: Show a progress bar on standard error.
        judging: ``strict``, ``tolerance``, ``required_steps`` and ``force``, as for
            `pdtui.driving.session_replay.replay_session`.

    Raises:
        PdtuiError: The session cannot be read, or the robot or the policy cannot be loaded.
    """
    given = str(policy or "") if policy is None or isinstance(policy, str | Path) else policy
    with progress_bar("replaying", quiet=not progress) as advance:
        judging |= {"robot": robot, "minutes": minutes, "progress": advance}
        return replay_session(Path(session), policy=given, **judging)
