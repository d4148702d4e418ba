"""Say in words where sessions branched off others."""

from __future__ import annotations

from pdtui.sessions.drive_info import BranchOrigin
from pdtui.sessions.session_header import SessionHeader


def describe_branch(origin: BranchOrigin) -> str:
    """Return where a session branched off."""
    return f"{origin.session} of {origin.created}, at step {origin.step}"


def describe_branches(first: SessionHeader, second: SessionHeader) -> list[str]:
    """Return how two sessions descend from each other or from the same one, a line for each fact."""

    def comes_from(branch: SessionHeader, parent: SessionHeader) -> bool:
        origin = branch.info.branch
        return origin is not None and (origin.session, origin.created) == (parent.path.name, parent.created)

    lines = []
    for branch, parent, words in (
        (second, first, "the second branched off the first"),
        (first, second, "the first branched off the second"),
    ):
        if branch.info.branch is not None and comes_from(branch, parent):
            lines.append(f"{words} at step {branch.info.branch.step}")
    one, other = first.info.branch, second.info.branch
    if one is not None and other is not None and one.created == other.created:
        lines.append(f"both branched off {one.session}, at steps {one.step} and {other.step}")
    return lines
