"""What `bench_accelerator` measures; needs neither JAX nor MJX."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AttributeAgreement:
    """How well the accelerator and the CPU agree on one attribute, over units and outputs.

    Attributes:
        name: The attribute's name.
        correlation: Spearman's rank correlation of the effects on the accelerator with those on the CPU, from
            the same starts.
        cpu_correlation: That of the CPU's effects from one half of the starts with those from the other: how
            much chance the starts leave.
        shared: Share of the CPU's strongest tenth that is in the accelerator's, over all starts; a tenth
            would be chance.
        confirmed: Effect on the CPU of what is strongest on the accelerator, over the CPU's strongest.
    """

    name: str
    correlation: float
    cpu_correlation: float
    shared: float
    confirmed: float


@dataclass(frozen=True)
class AcceleratorBenchmark:
    """The result of `bench_accelerator`.

    Attributes:
        device: What JAX calls the accelerator; a CPU where there is none.
        workers: Number of worker processes on the CPU.
        rollouts: Number of roll-outs, those without stimulation included.
        steps: Control steps of each.
        compile_seconds: Time of the accelerator's first run less that of a later one.
        accelerator_seconds, cpu_seconds: Time of all roll-outs.
        falls: Share of roll-outs that fell on the accelerator, and on the CPU.
        same_falls: Share of roll-outs that fell on both or on neither.
        attributes: Agreement by attribute.
    """

    device: str
    workers: int
    rollouts: int
    steps: int
    compile_seconds: float
    accelerator_seconds: float
    cpu_seconds: float
    falls: tuple[float, float]
    same_falls: float
    attributes: tuple[AttributeAgreement, ...]
