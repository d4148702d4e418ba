"""How much a dissection does."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from pdtui.search.behavior_search_settings import BehaviorSearchSettings
from pdtui.search.controller_search import ControllerSearchSettings
from pdtui.search.imprint_candidates import ImprintSettings


@dataclass(frozen=True)
class DissectionSettings:
    """How much a dissection does; the defaults are for ten to fifteen minutes on two idle cores.

    Attributes:
        steps: control steps of a monitored episode.
        screen_values, screen_starts, screen_steps: every unit at these outputs, from so many starts.
        refine_keep: units kept from screening for each attribute and direction.
        controls: units drawn at random, refined for comparison.
        refine_values, refine_starts, refine_steps: those units again, from other starts.
        steer_singles, steer_pairs: units tried alone, and second units tried beside the best of them, for
            each attribute and direction.
        steer_steps: control steps of those roll-outs.
        search_starts, selection_starts, held_out_starts: of the search for behaviors.
        walk: control steps between a reset and a start.
        imprint: how many imprints the searches begin from.
        search, hold: sizes of the searches.
    """

    steps: int = 1000
    screen_values: tuple[float, ...] = (-4.0, -2.0, 2.0, 4.0)
    screen_starts: int = 2
    screen_steps: int = 60
    refine_keep: int = 2
    controls: int = 48
    refine_values: tuple[float, ...] = (-8.0, -4.0, -2.0, 0.0, 2.0, 4.0, 8.0)
    refine_starts: int = 6
    refine_steps: int = 80
    steer_singles: int = 3
    steer_pairs: int = 4
    steer_steps: int = 240
    search_starts: int = 10
    selection_starts: int = 12
    held_out_starts: int = 16
    walk: int = 100
    imprint: ImprintSettings = field(default_factory=ImprintSettings)
    search: BehaviorSearchSettings = field(default_factory=BehaviorSearchSettings)
    hold: ControllerSearchSettings = field(default_factory=ControllerSearchSettings)

    @property
    def longest(self) -> int:
        """Control steps of the longest roll-out."""
        return max(
            self.screen_steps,
            self.refine_steps,
            self.steer_steps,
            self.search.quick_steps,
            self.search.full_steps,
            self.search.final_steps,
            self.hold.steps,
            self.hold.final_steps,
        )

    def within(self, steps: int) -> DissectionSettings:
        """The same with walks of so many steps, start and roll-out together; a quarter goes to the start."""
        walk = min(self.walk, steps // 4)
        most = max(1, steps - walk)
        search, hold = self.search, self.hold
        return replace(
            self,
            walk=walk,
            screen_steps=min(self.screen_steps, most),
            refine_steps=min(self.refine_steps, most),
            steer_steps=min(self.steer_steps, most),
            search=replace(
                search,
                quick_steps=min(search.quick_steps, most),
                full_steps=min(search.full_steps, most),
                final_steps=min(search.final_steps, most),
            ),
            hold=replace(hold, steps=min(hold.steps, most), final_steps=min(hold.final_steps, most)),
        )


QUICK_DISSECTION = DissectionSettings(
    steps=400,
    screen_values=(-3.0, 3.0),
    screen_steps=40,
    refine_keep=1,
    controls=8,
    refine_values=(-3.0, 0.0, 3.0),
    refine_starts=4,
    refine_steps=60,
    steer_singles=2,
    steer_pairs=0,
    steer_steps=160,
    search_starts=3,
    selection_starts=4,
    held_out_starts=8,
    walk=50,
    imprint=ImprintSettings(episodes=4, steps=40, bins=3, units=(8,), factors=(1.0,)),
    search=BehaviorSearchSettings(
        random_sets=12, single_units=6, elite=4, children=6, promoted=2, max_units=(3,), generations=2,
        quick_starts=1, quick_steps=60, full_starts=3, full_steps=120, finalists=2, final_steps=160,
    ),
    hold=ControllerSearchSettings(units=1, pairs=1, finalists=2, steps=60, final_steps=160),
)  # fmt: skip
"""A first look, for about a minute: fewer outputs of each unit, fewer starts, hardly a search."""
