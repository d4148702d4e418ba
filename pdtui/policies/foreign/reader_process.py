"""Starts the process that reads a file of another program, and takes its answer."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pdtui.core.errors import PolicyError
from pdtui.core.untrusted_file import (
    FOREIGN_POLICY_BUDGET,
    MIB,
    STATISTICS_BUDGET,
    FileBudget,
    open_regular_file,
)

if TYPE_CHECKING:
    import torch

CONTENT_KEY = "content"
REFUSED, OUT_OF_MEMORY = 3, 4
WAIT_FACTOR = 4
"""Times the allowed processor time that a reader may take by the clock, for a busy machine."""
_BUDGETS = {"policy": FOREIGN_POLICY_BUDGET, "statistics": STATISTICS_BUDGET}
_START = 20.0
"""Seconds in which a reader has to start, on a busy machine."""


@dataclass(frozen=True)
class ForeignFile:
    """What a file of another program holds.

    Attributes:
        source: Name of the file, for messages.
        form: ``tensors``, ``stable-baselines3`` or ``torchscript``.
        tensors: Tensors by name, in the order of the file.
        facts: What else it says, as `FoundContent` has it.
        sha256: Hash of the file.
    """

    source: str
    form: str
    tensors: dict[str, torch.Tensor]
    facts: dict[str, Any]
    sha256: str


def read_foreign_file(path: Path, content: Literal["policy", "statistics"] = "policy") -> ForeignFile:
    """Read a file of another program in a process of its own, which ends with it.

    Args:
        path: The file, whose format is told by its content.
        content: What the file is to hold: a policy, or statistics of the observation.

    Raises:
        PolicyError: The file cannot be read, is no such file, or takes more than its `FileBudget`.
    """
    budget = _BUDGETS[content]
    arguments = [content, str(budget.bytes), str(budget.memory), str(budget.seconds)]
    # The file is opened here, so that the reader gets a name from nobody and the right file in any case.
    try:
        with open_regular_file(path, budget.bytes) as file:
            done = subprocess.run(
                # -P: the working directory may hold files of other people, and is not a place for modules.
                [sys.executable, "-P", "-m", "pdtui.policies.foreign", *arguments],
                stdin=file,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=_environment(),
                timeout=_START + WAIT_FACTOR * budget.seconds,
                check=False,
            )
    except subprocess.TimeoutExpired as error:
        raise PolicyError(f"{path}: {_describe_excess(-signal.SIGALRM, budget)}") from error
    except OSError as error:
        raise PolicyError(f"{path}: cannot be read: {error.strerror}") from error
    if done.returncode == REFUSED:
        raise PolicyError(f"{path}: {done.stdout.decode('utf-8', 'replace')}")
    if done.returncode != 0:
        raise PolicyError(f"{path}: {_describe_excess(done.returncode, budget)}")
    return unpack_content(done.stdout, str(path))


def _environment() -> dict[str, str]:
    """Return the environment of a reader, which finds the modules that this process finds."""
    places = os.pathsep.join(place for place in sys.path if place)
    return os.environ | {"PYTHONPATH": places, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def _describe_excess(code: int, budget: FileBudget) -> str:
    if -code in (signal.SIGPROF, signal.SIGXCPU, signal.SIGALRM, signal.SIGKILL):
        return f"took longer to read than {budget.seconds:g} s, the limit for {budget.kind}"
    if code == OUT_OF_MEMORY or -code == signal.SIGABRT:
        return f"needs more memory to be read than {budget.memory // MIB} MiB, the limit for {budget.kind}"
    how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
    return f"cannot be read: the process that read it {how}"


def unpack_content(answer: bytes, source: str) -> ForeignFile:
    """Return the content of a file from the answer of the process that read it."""
    from safetensors.torch import load

    length = int.from_bytes(answer[:8], "little")
    facts = json.loads(json.loads(answer[8 : 8 + length])["__metadata__"][CONTENT_KEY])
    tensors = load(answer)
    ordered = {name: tensors[str(number)] for number, name in enumerate(facts["names"])}
    return ForeignFile(source, facts["form"], ordered, facts["facts"], facts["sha256"])
