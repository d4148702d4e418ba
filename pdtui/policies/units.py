"""Hidden units by address, and the stimulation that overwrites them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pdtui.errors import PolicyError

_ADDRESS = re.compile(r"(\d{1,6}):(\d{1,9})")


def describe_layers(layers: Sequence[int]) -> str:
    """The layers in words, for messages: ``layers 0..1 of 256 units``."""
    if len(set(layers)) == 1 and len(layers) > 1:
        return f"layers 0..{len(layers) - 1} of {layers[0]} units"
    return "layers " + ", ".join(f"{layer} of {width} units" for layer, width in enumerate(layers))


def parse_unit(address: str, layers: Sequence[int]) -> int:
    """Flat index of ``layer:index`` in a policy with these layer widths.

    Raises:
        PolicyError: not an address, or no such unit.
    """
    match = _ADDRESS.fullmatch(address)
    if match is None:
        raise PolicyError(f"unit '{address}': expected layer:index, such as 0:12")
    layer, index = int(match[1]), int(match[2])
    if layer >= len(layers) or index >= layers[layer]:
        raise PolicyError(f"unit {address} does not exist; the policy has {describe_layers(layers)}")
    return sum(layers[:layer]) + index


def format_unit(flat: int, layers: Sequence[int]) -> str:
    """``layer:index`` of a flat index."""
    for layer, width in enumerate(layers):
        if flat < width:
            return f"{layer}:{flat}"
        flat -= width
    raise PolicyError(f"unit index beyond the policy's {describe_layers(layers)}")


@dataclass(frozen=True)
class Stimulation:
    """Units and the outputs that overwrite them in one control step.

    Attributes:
        units: flat indices, layer by layer.
        values: the output v of each.
    """

    units: tuple[int, ...] = ()
    values: tuple[float, ...] = ()

    @classmethod
    def of(cls, values: Mapping[int, float]) -> Stimulation:
        """From a mapping of flat index to v."""
        return cls(tuple(values), tuple(values.values()))


NO_STIMULATION = Stimulation()
