"""Limits on work and memory of a forward pass of interpreted code, so that it cannot exhaust the machine."""

from __future__ import annotations

from collections.abc import Iterable

import torch

from pdtui.core.errors import PolicyError
from pdtui.core.untrusted_file import MIB

MAX_ELEMENTS = 1 << 26
"""Elements that an operator may create: 256 MiB of float32, far more than a control step needs."""
MAX_BYTES = 256 * MIB
"""Memory of all results of a pass, which may all be held until its end."""
MAX_WORK = 1 << 32
"""Multiplications of a pass; on one core, a network with more is too slow for a control step."""
MAX_EXPRESSIONS = 100_000
"""Expressions that a pass evaluates."""
OPERATOR_WORK = 1 << 14
"""What calling an operator costs besides its arithmetic: about as much as so many multiplications."""
_ELEMENT_WORK = 32
"""What a function of one number costs, such as pow, in multiplications."""
_SMALL = 1 << 16
"""Bytes of a result up to which it is not worth finding out whether it is a view."""
_SLOW_KIND = 8
"""How much slower PyTorch multiplies numbers other than float32 and float64, at least."""


class ForwardPassLimitError(PolicyError):
    """A forward pass would take more than it may."""


class ForwardPassBudget:
    """Counts what a forward pass takes; more than it may is a `ForwardPassLimitError`."""

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Begin a forward pass."""
        self._expressions = self._work = self._bytes = 0

    def count_evaluated_expression(self) -> None:
        """Count an expression before it is evaluated."""
        self._expressions += 1
        if self._expressions > MAX_EXPRESSIONS:
            raise ForwardPassLimitError(
                f"its code evaluates more than {MAX_EXPRESSIONS} expressions per step"
            )

    def count_work(self, multiplications: int, elements: int, tensors: Iterable[torch.Tensor]) -> None:
        """Count an operator's work before it is done.

        Args:
            multiplications: Multiplications besides what is done with each element.
            elements: Elements of the result.
            tensors: The operator's arguments.
        """
        slow, handled = 1, 0
        for tensor in tensors:
            handled += tensor.numel()
            if tensor.dtype not in (torch.float32, torch.float64):
                slow = _SLOW_KIND
        self._work += slow * multiplications + _ELEMENT_WORK * max(handled, elements) + OPERATOR_WORK
        if self._work > MAX_WORK:
            raise ForwardPassLimitError(f"its code takes more than {MAX_WORK} multiplications per step")

    def check_memory(self, elements: int, size: int = 4) -> None:
        """Check that so many more elements of a size in bytes can be held."""
        if self._bytes + elements * size > MAX_BYTES:
            raise ForwardPassLimitError(f"its code takes more than {MAX_BYTES // MIB} MiB of memory per step")

    def count_results(self, results: Iterable[torch.Tensor], arguments: Iterable[torch.Tensor]) -> None:
        """Count an operator's results, except views of its arguments."""
        for tensor in results:
            size = tensor.numel() * tensor.itemsize
            if size > _SMALL and 0 not in tensor.stride():
                memory = tensor.untyped_storage().data_ptr()
                if any(memory == one.untyped_storage().data_ptr() for one in arguments):
                    continue
            self._bytes += size
        self.check_memory(0)
