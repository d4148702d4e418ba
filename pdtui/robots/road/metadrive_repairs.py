"""Repairs of MetaDrive 0.4.3: what it observes, and the blocks that its roads are made of."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

OBSERVATIONS = 275
LIDAR_RAYS, LIDAR_RANGE = 240, 50.0
OTHER_CARS = 4
FIRST_OTHER_CAR, FIRST_RAY = 19, 35
# Sideways positions of the next two checkpoints.
_SIDEWAYS_CHECKPOINTS = (10, 15)


def repair_observation(observed: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return an observation, shape (275,), that means what it means to the policy in MetaDrive's wheel.

    Since MetaDrive turned its y axis from right to left, it observes some sideways quantities turned round.

    The first 9 numbers are the car's own state, the next 10 the route's next two checkpoints, the next 16
    position and velocity of the four nearest cars relative to this one, and the last 240 the lidar's rays,
    from straight ahead clockwise.
    """
    repaired = observed.astype(np.float32)
    for index in _SIDEWAYS_CHECKPOINTS:
        repaired[index] = 1.0 - repaired[index]
    others = repaired[FIRST_OTHER_CAR:FIRST_RAY].reshape(OTHER_CARS, 4)
    present = others.any(axis=1)
    others[present, 1::2] = 1.0 - others[present, 1::2]
    # The ray straight ahead stays; the others change sides.
    repaired[FIRST_RAY + 1 :] = repaired[:FIRST_RAY:-1]
    return repaired


def blocks_without_ramps() -> Any:
    """Return MetaDrive's probabilities of blocks without those whose lanes are wrong.

    A ramp has wrong lanes where the road does not run along the x axis.
    """
    from metadrive.component.algorithm.blocks_prob_dist import PGBlockDistConfig

    shares = PGBlockDistConfig.BLOCK_TYPE_DISTRIBUTION_V2
    kept = {name: 0.0 if "Ramp" in name else share for name, share in shares.items()}
    total = sum(kept.values())
    normalized = {name: share / total for name, share in kept.items()}
    return type("BlocksWithoutRamps", (PGBlockDistConfig,), {"BLOCK_TYPE_DISTRIBUTION_V2": normalized})
