"""Worlds in another process, for simulators that hold on to Python while they step."""

from __future__ import annotations

import multiprocessing
import signal
from functools import partial
from multiprocessing.connection import Connection
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import TrainingError
from pdtui.robots import make_robot
from pdtui.training.sac import TransitionBatch
from pdtui.training.world_batch import WorldBatch, WorldBatchState


def _serve(connection: Connection, robot: str, options: dict[str, Any], count: int, seed: int) -> None:
    # Ctrl-C reaches the whole process group; only the parent answers it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        worlds = WorldBatch(partial(make_robot, robot, **options), count, seed)
        answer: Any = None
        while True:
            connection.send((answer, worlds.observations, worlds.restarted))
            name, arguments = connection.recv()
            answer = getattr(worlds, name)(*arguments)
    except (EOFError, OSError):
        return  # the parent is gone
    except Exception as error:
        connection.send(error)


class RemoteWorldBatch(WorldBatch):
    """`WorldBatch` whose robots live in a process of their own; the same numbers, step for step.

    Args:
        robot: its name.
        options: for its class.
        count: how many.
        seed: of their episodes.

    Raises:
        TrainingError: the process died.
    """

    def __init__(self, robot: str, options: dict[str, Any], count: int, seed: int) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        arguments = (theirs, robot, options, count, seed)
        self.process = context.Process(target=_serve, args=arguments, name="pdtui worlds", daemon=True)
        self.process.start()
        theirs.close()
        self._receive()

    def step(self, actions: NDArray[np.float32]) -> TransitionBatch:
        return cast(TransitionBatch, self._ask("step", actions))

    def state(self) -> WorldBatchState:
        return cast(WorldBatchState, self._ask("state"))

    def restore(self, state: WorldBatchState) -> None:
        self._ask("restore", state)

    def _ask(self, name: str, *arguments: Any) -> Any:
        try:
            self._connection.send((name, arguments))
        except OSError as error:
            raise self._died() from error
        return self._receive()

    def _receive(self) -> Any:
        try:
            message = self._connection.recv()
        except (EOFError, OSError) as error:
            raise self._died() from error
        if isinstance(message, Exception):
            raise message
        answer, self.observations, self.restarted = message
        return answer

    def _died(self) -> TrainingError:
        self.process.join(timeout=1.0)
        return TrainingError(
            f"a process with worlds to train in ended (exit code {self.process.exitcode}); the run goes on "
            "from its last checkpoint when the same command is given again"
        )
