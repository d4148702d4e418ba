"""A Ray cluster: the machines that `ray start` has joined, or all cores of this machine."""

from __future__ import annotations

import logging
import os
import socket
import sys
from collections.abc import Callable, Iterator, Sequence
from hashlib import sha256
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import Any

from pdtui.core.closable import Closable
from pdtui.core.cluster.node_jobs import StateRecipe, collect_environment, describe_installation, run_job
from pdtui.core.cluster.ray_worker import RayWorker, describe_ray_error
from pdtui.core.errors import ClusterError, WorkerError
from pdtui.core.processes.call_answer import take_answer

AUTO = "auto"
RUNS_PER_JOB = 4
"""Times that a job is run whose process or node is lost, before the loss is an error."""
_LEAST_WAITING, _WAITING_PER_CORE = 64, 4
"""Jobs that are handed to Ray at a time: enough for all cores to stay busy."""
_CONNECT_SECONDS, _CANCEL_SECONDS = 5.0, 2.0
_AUTH_MODE = "RAY_AUTH_MODE"
_LOOPBACK = ("127.0.0.1", "localhost")
# Ray calls itself by the machine's outer address, except where this variable says that there is no cluster
# to join, as on macOS. It then binds to 127.0.0.1.
_BIND_TO_LOOPBACK = "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"


class RayCluster(Closable):
    """Runs jobs on a cluster; Ray decides where, and runs those again whose process or node is lost.

    Everything on a cluster trusts everything else: Ray's processes send each other pickled objects. What
    comes from outside, such as files of weights, is sent as bytes and read there as it is here.

    It is joined when it is first used.

    Args:
        address: Address of the cluster's head node, ``HOST:PORT``; or ``auto`` for the cluster that this
            machine has joined, or else a cluster of this machine alone, which binds to 127.0.0.1 (unless Ray
            was imported before) and ends with this process.

    Raises:
        ClusterError: The extra ``cluster`` is not installed, or the address is none.
    """

    def __init__(self, address: str = AUTO) -> None:
        if find_spec("ray") is None:
            raise ClusterError("a cluster needs the extra: pip install 'pdtui[cluster]'")
        self.address = address
        self._place = (_LOOPBACK[0], 0) if address == AUTO else _parse_address(address)
        self._files: dict[str, Any] = {}
        self._found = self._joined = False

    def __str__(self) -> str:
        return f"a cluster of {self.cores} cores"

    @property
    def cores(self) -> int:
        """Number of cores that the cluster has now."""
        ray = self.connect()
        resources: dict[str, float] = ray.cluster_resources()
        return int(resources.get("CPU", 0))

    def close(self) -> None:
        """Leave the cluster; one of this machine alone ends."""
        if self._joined:
            self.connect().shutdown()
        self._files.clear()
        self._found = self._joined = False

    def add_file(self, path: Path) -> str:
        """Send a file to the cluster, and return its name in the working directory of the processes there.

        The name contains the hash of the content, so that a file is sent once, whatever it is called here.

        Raises:
            ClusterError: The file cannot be read.
        """
        try:
            content = path.read_bytes()
        except OSError as error:
            raise ClusterError(f"{path}: cannot be read: {error.strerror}") from error
        name = f"./{sha256(content).hexdigest()}/{path.name}"
        if name not in self._files:
            self._files[name] = self.connect().put(content)
        return name

    def start_worker(self, name: str, build: Callable[..., Any], *arguments: Any) -> RayWorker:
        """Start a process on some node that holds a state and answers calls; see `RayWorker`."""
        return RayWorker(name, self.put_recipe(build, arguments))

    def put_recipe(self, build: Callable[..., Any], arguments: tuple[Any, ...]) -> list[Any]:
        """Send what processes need to build a state, and return the reference to it, in a list."""
        recipe = StateRecipe(
            build, arguments, describe_installation(), collect_environment(), dict(self._files)
        )
        return [self.connect().put(recipe)]

    def as_completed(
        self, name: str, recipe: list[Any], function: Callable[..., Any], jobs: Sequence[Any]
    ) -> Iterator[tuple[int, Any]]:
        """Run all jobs and yield the index and the result of each, once, as soon as it is finished.

        Args:
            name: What the jobs work on, for error messages.
            recipe: What `put_recipe` returned.
            function: Function of a module, called with the state and a job.
            jobs: The jobs.

        Raises:
            WorkerError: A job lost its process or its node `RUNS_PER_JOB` times.
            ClusterError: A node has other versions.
        """
        ray = self.connect()
        remote = ray.remote(run_job).options(num_cpus=1, max_retries=RUNS_PER_JOB - 1, name=f"pdtui {name}")
        waiting = iter(enumerate(jobs))
        most = max(_LEAST_WAITING, _WAITING_PER_CORE * self.cores)
        running: dict[Any, int] = {}
        try:
            while True:
                for number, job in islice(waiting, most - len(running)):
                    running[remote.remote(recipe, function, job)] = number
                if not running:
                    return
                ray.wait(list(running))
                finished, _ = ray.wait(list(running), num_returns=len(running), timeout=0)
                for reference in finished:
                    number = running.pop(reference)
                    yield number, _take_result(name, reference)
        finally:
            for reference in running:
                ray.cancel(reference, force=True)
            if running:  # the end of this process may follow, and Ray does not like to be interrupted
                ray.wait(list(running), num_returns=len(running), timeout=_CANCEL_SECONDS)

    def connect(self) -> Any:
        """Connect to the cluster if this process has not yet, and return the module of Ray.

        Raises:
            ClusterError: There is no cluster, or no node of it has cores.
        """
        if self._place[0] in _LOOPBACK and "ray" not in sys.modules:
            os.environ[_BIND_TO_LOOPBACK] = "0"
        os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")  # silences a warning
        import ray

        if self._found and ray.is_initialized():
            return ray
        if self.address != AUTO:
            self._check_listener()
        if not ray.is_initialized():
            self._start_ray(ray)
        self._found = True
        if self.cores == 0:
            self.close()
            raise ClusterError(f"cluster {self.address}: expected a node with cores, found none")
        return ray

    def _start_ray(self, ray: Any) -> None:
        _silence_standard_output()
        try:
            ray.init(
                address=None if self.address == AUTO else self.address,
                include_dashboard=False,
                log_to_driver=False,
                logging_level=logging.ERROR,
            )
        except (ConnectionError, RuntimeError, ValueError) as error:
            reason = str(error).strip().partition("\n")[0]
            raise ClusterError(
                f"cluster {self.address}: {reason}; this machine has to be one of its nodes (`ray start "
                f"--address=HOST:PORT`), and {_AUTH_MODE}=token has to be set if the cluster asks for a token"
            ) from error
        self._joined = True

    def _check_listener(self) -> None:
        """Refuse an address at which nothing listens at once; Ray would try for a long time."""
        try:
            socket.create_connection(self._place, _CONNECT_SECONDS).close()
        except OSError as error:
            raise ClusterError(
                f"no cluster at {self.address}: {error}; `ray start --head` starts one, "
                "--cluster auto needs none"
            ) from error


def _silence_standard_output() -> None:
    """Keep Ray from printing what nodes report to standard output, where ``--json`` writes.

    It has no setting for that. What matters of it comes as an exception.
    """
    from ray._private import worker

    if hasattr(worker, "print_to_stdstream"):
        worker.print_to_stdstream = lambda *_, **__: None


def _parse_address(address: str) -> tuple[str, int]:
    host, colon, port = address.rpartition(":")
    if not (colon and host and port.isdecimal() and int(port) < 1 << 16 and "/" not in host):
        raise ClusterError(f"expected a cluster's address HOST:PORT or auto, found '{address}'")
    return host, int(port)


def _take_result(name: str, reference: Any) -> Any:
    import ray

    try:
        answer = ray.get(reference)
    except ray.exceptions.RayError as error:
        raise WorkerError(f"{name}: {describe_ray_error(error)}") from error
    return take_answer(answer)


Workers = int | RayCluster
"""Where jobs run: in this number of worker processes, or on a cluster."""
