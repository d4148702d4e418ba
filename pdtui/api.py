"""pdtui from Python: load a policy, dissect it, drive it, replay it. Each function is a room's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from torch import nn

from pdtui.core.errors import SessionError
from pdtui.dissection import dissect as dissection
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_settings import QUICK_DISSECTION, DissectionSettings
from pdtui.drive.drive_config import DriveConfig
from pdtui.drive.keystrokes import read_keystrokes
from pdtui.drive.loop_builder import build_loop
from pdtui.drive.replay import ReplayResult, replay_session
from pdtui.drive.trajectory import Trajectory, collect_trajectory
from pdtui.policies.runtime.action_decoders import Decoder
from pdtui.policies.runtime.live_network import policy_from_network
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.torchscript import is_torchscript, read_torchscript
from pdtui.policies.weights import policy_loading
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions, WorldSpaces
from pdtui.policies.weights.weights_file import hash_file
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_policy_lookup import resolve_map_policy
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.stimulation_map import StimulationMap

__all__ = [
    "QUICK_DISSECTION",
    "Dissection",
    "DissectionSettings",
    "ImportOptions",
    "Policy",
    "Trajectory",
    "dissect",
    "drive",
    "load_policy",
    "replay",
]


def load_policy(
    policy: str | Path | nn.Module,
    robot: str | Robot | None = None,
    *,
    import_options: ImportOptions = NO_OPTIONS,
    observations: int | Sequence[int] | None = None,
    hidden: Sequence[str] | None = None,
    decode: Decoder | None = None,
    batched: bool = False,
    initial_state: Any = None,
    name: str = "",
) -> Policy:
    """A policy whose hidden units can be read and overwritten, from a file or a live network.

    >>> import numpy as np, pdtui
    >>> policy = pdtui.load_policy("ant")
    >>> list(policy.layers)
    [256, 256]
    >>> step = policy.act(np.zeros(27))
    >>> step.action.shape, step.activations.shape
    ((8,), (512,))

    A network in memory needs the robot that it is for, or the shape of its observation:

    >>> from torch import nn
    >>> network = nn.Sequential(nn.Linear(27, 16), nn.Tanh(), nn.Linear(16, 8))
    >>> pdtui.load_policy(network, "ant").layers
    (16,)

    Args:
        policy: a weights file, the name of a shipped policy, a `torch.nn.Module`, which is copied, or a
            TorchScript file, which is read as data (see `pdtui.policies.torchscript`).
        robot: that it is for; gives the bounds of actions that somebody else's file may lack.
        import_options: what somebody else's file leaves open; see `pdtui.policies.importers`.
        observations, hidden, decode, batched, initial_state, name: of a live or TorchScript network; see
            `pdtui.policies.runtime.live_network.policy_from_network`.

    Raises:
        PdtuiError: it cannot be had, or is for another robot.
    """
    sha256 = ""
    if not isinstance(policy, nn.Module) and is_torchscript(Path(policy)):
        name, sha256 = name or Path(policy).stem, hash_file(Path(policy))
        policy = read_torchscript(Path(policy))
    world = make_robot(robot) if isinstance(robot, str) else robot
    if not isinstance(policy, nn.Module):
        if world is None:
            return policy_loading.load_policy(policy, import_options=import_options)
        return policy_loading.load_policy(
            policy, world.name, import_options=import_options, spaces=WorldSpaces.of_world(world)
        )
    return policy_from_network(
        policy,
        world.observation_space if world is not None else None,
        world.action_space if world is not None else None,
        observations=observations,
        hidden=hidden,
        decode=decode,
        batched=batched,
        initial_state=initial_state,
        name=name,
        sha256=sha256,
    )


def dissect(
    robot: str | Robot,
    policy: str | Path | nn.Module | Policy,
    *,
    import_options: ImportOptions = NO_OPTIONS,
    preset: str = "paper",
    settings: Sequence[str] = (),
    episodes: int = 5,
    seed: int = 1000,
    budget_minutes: float | None = None,
    workers: int = 2,
    effort: DissectionSettings | None = None,
    progress: dissection.StageProgress | None = None,
    journal: Path | None = None,
) -> Dissection:
    """Find out which hidden units move what: monitor, match, probe, and search for behaviors.

    A robot and a policy that are given by name are dissected by `workers` processes, which load them again.
    An object stays where it is, in this process; the result is the same.

    >>> import pdtui
    >>> from torch import nn
    >>> network = nn.Sequential(nn.Linear(27, 4), nn.Tanh(), nn.Linear(4, 8))
    >>> _ = nn.init.constant_(network[2].weight, 0.01)
    >>> found = pdtui.dissect("ant", network, episodes=1, effort=pdtui.QUICK_DISSECTION, budget_minutes=0.0)
    >>> found.screen.effects.shape[0], found.matching.discrepancy.shape[1]  # a row, a column for each unit
    (4, 4)
    >>> found.to_map().robot
    'ant'

    Args:
        robot: its name, or a `Robot`.
        policy: a weights file, a shipped name, a live network, or a `Policy`.
        import_options, preset, settings, episodes, seed, budget_minutes, workers, effort, progress,
            journal: as for `pdtui.dissection.dissect.dissect`.

    Raises:
        PdtuiError: what is wrong with robot or policy.
    """
    return dissection.dissect(
        robot,
        load_policy(policy, robot) if isinstance(policy, nn.Module) else policy,
        import_options=import_options,
        preset=preset,
        settings=settings,
        episodes=episodes,
        seed=seed,
        budget_minutes=budget_minutes,
        workers=workers,
        effort=effort,
        progress=progress,
        journal=journal,
    )


def drive(
    robot: str | Robot,
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
    force: bool = False,
) -> Trajectory:
    """Drive without a screen, as fast as it goes.

    >>> import pdtui
    >>> drive = pdtui.drive("ant", keys={50: "x"}, steps=150)
    >>> drive
    <Drive of ant by ant: 150 steps (7.5 s), 1 events, 0 falls>
    >>> bool(drive["speed"][-20:].mean() < drive["speed"][30:50].mean())
    True

    Args:
        robot: its name, or a `Robot`.
        stimulation_map: a map, or its name or file; by default the one named as the robot.
        policy: instead of the map's; a live network's has to be the one that the map was made for.
        import_options: what the weights file leaves open, over what the map says.
        keys: one key or several, by the control step before which they are pressed; or a keystroke file.
        steps: control steps.
        seed: of the reset and of every random number.
        stochastic: draw actions from the policy's distribution instead of taking its mean.
        start: state in which episodes start, for a robot with several.
        record: a new session file.
        force: drive although the map was made for another policy.

    Raises:
        PdtuiError: robot, map or policy cannot be had, do not fit each other, or a key means nothing.
    """
    name = robot.name if isinstance(robot, Robot) else robot
    if not isinstance(stimulation_map, StimulationMap):
        stimulation_map = load_map(find_map(str(stimulation_map or name)))
    live = load_policy(policy, robot) if isinstance(policy, nn.Module) else policy
    given = live if isinstance(live, Policy) else None
    named = "" if given is not None or live is None else str(live)
    stimulation_map = resolve_map_policy(stimulation_map, named, import_options)
    config = DriveConfig(name, stimulation_map, seed, stochastic=stochastic, start=start, force=force)
    loop = build_loop(config, robot if isinstance(robot, Robot) else None, given)
    presses = read_keystrokes(Path(keys), stimulation_map) if isinstance(keys, str | Path) else keys or {}
    if record is not None and Path(record).exists():
        raise SessionError(f"{record}: exists already; a drive is recorded into a new file")
    recorder = SessionRecorder(Path(record), loop.info) if record is not None else None
    return collect_trajectory(loop, presses, steps, recorder)


def replay(
    session: str | Path,
    *,
    robot: Robot | None = None,
    policy: str | Path | nn.Module | Policy | None = None,
    **judging: Any,
) -> ReplayResult:
    """Run a session again and compare every step.

    >>> import pdtui, tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "walk.rrd"
    ...     _ = pdtui.drive("ant", keys={10: "x"}, steps=30, record=path)
    ...     print(pdtui.replay(path).first_difference)
    None

    Args:
        session: the file.
        robot: where the session's is not known by its name.
        policy: where the session's is not where its map says.
        judging: `strict`, `tolerance`, `required_steps`, `force`; see `pdtui.drive.replay.replay_session`.

    Raises:
        PdtuiError: the session cannot be read, or robot or policy cannot be had.
    """
    if isinstance(policy, nn.Module):
        policy = load_policy(policy, robot)
    given = policy if isinstance(policy, Policy) else str(policy or "")
    return replay_session(Path(session), policy=given, robot=robot, **judging)
