"""Hidden units by address, and what a control step changes about them."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import PolicyError

ADDRESS = re.compile(r"([\w.]{1,200}):(\d{1,9})")
"""``layer:index``, the layer by its number or its name."""

MAX_LISTED = 6
"""Largest number of units that a text lists one by one."""

_NAME = re.compile(r"[\w.]{1,200}")


class LayerWidths(tuple[int, ...]):
    """Widths of a policy's hidden layers, and the names that its layers have besides their numbers.

    Args:
        widths: units of each layer.
        names: names of each layer, the one to show first. A name that two layers share, or that reads as a
            number, is ambiguous and is left out.

    Attributes:
        names: the names that are left; empty for a layer that is known by its number alone.
    """

    names: tuple[tuple[str, ...], ...]

    def __new__(cls, widths: Iterable[int], names: Sequence[Sequence[str]] = ()) -> LayerWidths:
        layers = super().__new__(cls, widths)
        uses = Counter(name for own in names for name in set(own))
        usable = {name for name in uses if uses[name] == 1 and _NAME.fullmatch(name) and not name.isdecimal()}
        layers.names = tuple(tuple(name for name in dict.fromkeys(own) if name in usable) for own in names)
        return layers


def describe_layers(layers: Sequence[int]) -> str:
    """Describe the layers for messages: ``layers 0..1 of 256 units``."""
    names = [_layer_names(layers, layer)[:1] for layer in range(len(layers))]
    named = [f" ({name[0]})" if name else "" for name in names]
    if len(set(layers)) == 1 and len(layers) > 1 and not any(named):
        return f"layers 0..{len(layers) - 1} of {layers[0]} units"
    parts = enumerate(zip(named, layers, strict=True))
    return "layers " + ", ".join(f"{layer}{name} of {width} units" for layer, (name, width) in parts)


def parse_unit(address: str, layers: Sequence[int]) -> int:
    """Return the flat index of ``layer:index`` in a policy with these layer widths.

    The layer is a number, or one of its names where `layers` are `LayerWidths` with names: ``conv1:37``. A
    unit of a layer of any shape counts in C order.

    Raises:
        PolicyError: not an address, or no such unit.
    """
    match = ADDRESS.fullmatch(address)
    if match is None:
        raise PolicyError(f"unit '{address}': expected layer:index, such as 0:12")
    layer, index = _find_layer(match[1], layers), int(match[2])
    if layer is None or index >= layers[layer]:
        raise PolicyError(f"unit {address} does not exist; the policy has {describe_layers(layers)}")
    return sum(layers[:layer]) + index


def format_unit(flat: int, layers: Sequence[int]) -> str:
    """Return ``layer:index`` of a flat index, by the layer's name where it has one."""
    layer, index = split_flat_index(flat, layers)
    return f"{next(iter(_layer_names(layers, layer)), layer)}:{index}"


def split_flat_index(flat: int, layers: Sequence[int]) -> tuple[int, int]:
    """Return the layer of a flat index and the index in that layer; `PolicyError` if it is too large."""
    for layer, width in enumerate(layers):
        if flat < width:
            return layer, flat
        flat -= width
    raise PolicyError(f"unit index beyond the policy's {describe_layers(layers)}")


def _layer_names(layers: Sequence[int], layer: int) -> tuple[str, ...]:
    names = layers.names if isinstance(layers, LayerWidths) else ()
    return names[layer] if layer < len(names) else ()


def _find_layer(name: str, layers: Sequence[int]) -> int | None:
    if name.isdecimal():
        return int(name) if int(name) < len(layers) else None
    return next((layer for layer in range(len(layers)) if name in _layer_names(layers, layer)), None)


class UnitEdit(ABC):
    """A change to the outputs of units of one layer that may depend on what they would put out.

    Attributes:
        units: flat indices of the units, all of one layer, shape (n,).
    """

    units: NDArray[np.int64]

    @abstractmethod
    def change(self, outputs: NDArray[np.float32]) -> NDArray[np.floating[Any]]:
        """Return the new outputs of the units, given their outputs so far, each of shape (n,)."""

    def prepare(
        self, observation: NDArray[Any], activations: Callable[[NDArray[Any], int], NDArray[np.float32]]
    ) -> UnitEdit:
        """Return the edit for one control step; most do not depend on these arguments.

        Args:
            observation: what the policy observes.
            activations: returns what the hidden units, up to the layer of a flat index, would put out for an
                observation, shape (U,); the rest is undefined.
        """
        del observation, activations
        return self


@dataclass(frozen=True)
class Stimulation:
    """What one control step does to hidden units: it overwrites some, and then makes edits in their order.

    Attributes:
        units: flat indices of the units that are overwritten by constants, layer by layer.
        values: the output v of each of them.
        edits: changes that are not by constants.
    """

    units: tuple[int, ...] = ()
    values: tuple[float, ...] = ()
    edits: tuple[UnitEdit, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.units or self.edits)

    def touched_units(self) -> NDArray[np.int64]:
        """Return the flat indices of all units that it may change, each once, shape (n,)."""
        own = np.array(self.units, np.int64)
        if not self.edits:
            return own
        if not self.units and len(self.edits) == 1:
            return self.edits[0].units
        edited = [unit for edit in self.edits for unit in edit.units.tolist()]
        return np.array(list(dict.fromkeys((*self.units, *edited))), np.int64)

    @classmethod
    def of(cls, values: Mapping[int, float]) -> Stimulation:
        """Return the stimulation that sets units, given by flat index, to the outputs v."""
        return cls(tuple(values), tuple(values.values()))

    def by_address(self, layers: Sequence[int]) -> dict[str, float]:
        """Return the outputs v by the addresses of their units."""
        pairs = zip(self.units, self.values, strict=True)
        return {format_unit(unit, layers): value for unit, value in pairs}


NO_STIMULATION = Stimulation()


def describe_units(outputs: Mapping[str, float]) -> str:
    """Return units and their outputs as text, or only their number if there are more than `MAX_LISTED`."""
    if len(outputs) > MAX_LISTED:
        return f"{len(outputs)} units"
    return ", ".join(f"{unit} = {value:g}" for unit, value in outputs.items())
