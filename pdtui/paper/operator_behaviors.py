"""The behaviors of a map that a scripted operator uses."""

from __future__ import annotations

from collections.abc import Sequence

from pdtui.core.errors import MapError
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap


def find_operator_behaviors(
    stimulation_map: StimulationMap, needed: Sequence[str], useful: Sequence[str] = ()
) -> dict[str, Behavior]:
    """Return the behaviors that do an operator's tasks, by task; one without a task counts by its name.

    Raises:
        MapError: The map lacks a behavior for a task that is needed.
    """
    by_task = {one.task or one.name: one for one in stimulation_map.behaviors.values()}
    missing = [task for task in needed if task not in by_task]
    if missing:
        raise MapError(
            f"{stimulation_map.source}: the operator needs a behavior for each of {', '.join(needed)}; "
            f"missing: {', '.join(missing)}; the map has {', '.join(by_task) or 'none'}"
        )
    return {task: by_task[task] for task in (*needed, *useful) if task in by_task}
