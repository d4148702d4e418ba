"""How much a search for a behavior does."""

from __future__ import annotations

from dataclasses import dataclass, field

from pdtui.search.stimulation_sampler import OutputBounds


@dataclass(frozen=True)
class BehaviorSearchSettings:
    """How much a search does.

    Attributes:
        random_sets: random pairs and triples, probed once and shared by all goals.
        single_units: single units and values from the sweeps that it combines.
        elite: candidates kept from one generation to the next.
        children: candidates of one generation.
        promoted: of them, those probed from more starts.
        max_units: units of a candidate at most, in the first round and in those that follow where the goal
            was not reached: a behavior of many units is a direction in a layer.
        generations: of one round, at most.
        patience: generations without progress before a round ends.
        quick_starts, quick_steps: of the first look at a child.
        full_starts, full_steps: of the second.
        finalists: elite that the selection starts decide between.
        final_steps: stimulated control steps of the selection and of the held-out score.
        satisfied: score at which it ends early.
        safe: score from which no round with more units follows: what the search sees flatters a little.
        bounds: of the outputs v.
    """

    random_sets: int = 240
    single_units: int = 40
    elite: int = 16
    children: int = 28
    promoted: int = 8
    max_units: tuple[int, ...] = (3, 8, 24, 64)
    generations: int = 24
    patience: int = 6
    quick_starts: int = 3
    quick_steps: int = 110
    full_starts: int = 8
    full_steps: int = 240
    finalists: int = 6
    final_steps: int = 300
    satisfied: float = 1.8
    safe: float = 1.25
    bounds: OutputBounds = field(default_factory=OutputBounds)
