"""Which processes a process has started, from /proc."""

from __future__ import annotations

from pathlib import Path


def list_children(pid: int) -> list[int]:
    """Return the children that all its threads have started; none of a process that is gone."""
    found: list[int] = []
    try:
        for thread in Path(f"/proc/{pid}/task").iterdir():
            found += map(int, (thread / "children").read_text().split())
    except OSError:
        pass
    return found


def list_descendants(pid: int) -> list[int]:
    """Return the children, their children, and so on."""
    children = list_children(pid)
    return children + [other for child in children for other in list_descendants(child)]


def find_simulation(screen: int) -> int:
    """Return the simulation's process, which a screen's child has forked; 0 while there is none."""
    return next((one for child in list_children(screen) for one in list_children(child)), 0)


def list_siblings(pid: int) -> set[int]:
    """Return the other processes that the same process has forked."""
    parent = int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    return set(list_children(parent)) - {pid}
