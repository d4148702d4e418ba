"""What the screen is told of the ghost, as plain data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from pdtui.core.attributes import Floats

GhostCondition = Literal["loading", "waiting", "starting", "running", "over", "failed"]


@dataclass(frozen=True)
class GhostPose:
    """Ghost and drive after the same control step, the latest that both have done.

    Attributes:
        step: number of control steps done, as in `DriveSnapshot`.
        attributes: those of the ghost, shape (J,).
        drive_attributes: those of the drive, shape (J,).
        poses: poses of the ghost's bodies, shape (B, 7).
    """

    step: int
    attributes: Floats
    drive_attributes: Floats
    poses: Floats


@dataclass(frozen=True)
class GhostSnapshot:
    """The present state of a ghost that is on, and its history and path since the last snapshot.

    Attributes:
        condition: ``loading`` robot and policy; ``waiting`` for a behavior to be latched; ``starting`` from
            the drive's state; ``running``; ``over`` where its own episode has ended; ``failed``.
        message: how its episode ended, or why there is no ghost; else empty.
        first: the control step before which it began; −1 where there is none.
        latest: the latest control step that ghost and drive have done; None before the first.
        history: attributes of the ghost in the steps up to that one, shape (n, J).
        path: x, y of the ghost in m, in the same steps, shape (n, 2); empty for a robot without poses.
        label: what is other in it than that it has no behaviors; else empty.
    """

    condition: GhostCondition
    message: str = ""
    first: int = -1
    latest: GhostPose | None = None
    history: Floats | None = None
    path: Floats | None = None
    label: str = ""
