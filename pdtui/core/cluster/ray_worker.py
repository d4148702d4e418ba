"""A process on a node of a cluster that holds a state and answers calls, as `WorkerProcess` does here."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from pdtui.core.closable import Closable
from pdtui.core.cluster.node_jobs import build_state
from pdtui.core.errors import WorkerError
from pdtui.core.processes.call_answer import CallAnswer, answer_call, take_answer


class CallServer:
    """The actor behind a `RayWorker`; the first call builds the state, and reports errors in that."""

    def __init__(self, recipe: list[Any]) -> None:
        self._recipe = recipe

    @cached_property
    def _state(self) -> Any:
        import ray

        return build_state(ray.get(self._recipe[0]))

    def call(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> CallAnswer:
        """Call a function of a module with the state and arguments."""
        return answer_call(lambda: function(self._state, *arguments))


class RayWorker(Closable):
    """A process on some node of a cluster that answers function calls, one at a time.

    Several are spread over the nodes. It is not started again when it is lost: its state is gone.

    Args:
        name: What it works on, for error messages.
        recipe: What `RayCluster.put_recipe` returned.
    """

    def __init__(self, name: str, recipe: list[Any]) -> None:
        import ray

        self.name = name
        self._actor: Any = ray.remote(CallServer).options(scheduling_strategy="SPREAD").remote(recipe)
        self._answer: Any = None

    def send(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Call a function of a module with the state and arguments."""
        self._answer = self._actor.call.remote(function, arguments)

    def receive(self) -> Any:
        """Wait for the result of the call and return it, or raise the exception that the call raised.

        The loss of the process or of its node is a `WorkerError`.
        """
        import ray

        try:
            answer = ray.get(self._answer)
        except ray.exceptions.RayError as error:
            raise WorkerError(f"{self.name}: {describe_ray_error(error)}") from error
        return take_answer(answer)

    def close(self) -> None:
        """End the process."""
        import ray

        if ray.is_initialized():
            ray.kill(self._actor)


def describe_ray_error(error: BaseException) -> str:
    """Return what Ray reports in one line."""
    from ray.exceptions import RayTaskError

    lines = [line.strip() for line in str(error).splitlines() if line.strip()] or [type(error).__name__]
    if isinstance(error, RayTaskError):  # raised outside of the call, as where a node lacks a module
        return f"a process of the cluster failed ({lines[-1]})"
    return f"the cluster lost a process or a node ({lines[0]})"
