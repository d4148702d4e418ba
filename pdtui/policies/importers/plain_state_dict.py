"""A plain state dict: one chain of linear layers with any names."""

from __future__ import annotations

import re

import torch

from pdtui.core.errors import PolicyError
from pdtui.policies.importers.partial_policy import (
    LinearLayer,
    PartialPolicy,
    Tensors,
    check_layer_chain,
    describe_tensors,
    read_linear_layer,
)

_ACTOR = re.compile(r"actor|policy|(^|[._/])pi([._/]|$)|action")
_OTHER = re.compile(r"critic|value|(^|[._/])[qv]f?\d?([._/]|$)|target|optim")
_LOG_STD = re.compile(r"(.*[._/])?(actor_|action_)?log_?std(_param)?")
_NUMBERED = re.compile(r"(.*?)[._]?(\d{1,6})")


def import_plain_state_dict(tensors: Tensors, source: str) -> PartialPolicy:
    """Return the only chain of linear layers, or the only one whose names say that it is the actor.

    Layers are taken in the order of the file, those of one container in the order of their numbers.
    """
    own = {name: tensor for name, tensor in tensors.items() if not _OTHER.search(name.lower())}
    named = {name: tensor for name, tensor in own.items() if _ACTOR.search(name.lower())}
    for candidates in (named, own, tensors):
        chains = _find_chains(candidates)
        if len(chains) == 1:
            layers, names = chains[0]
            check_layer_chain(layers, names[0])
            return PartialPolicy(
                f"a plain state dict ({names[0]} … {names[-1]})", layers, log_std=_find_log_std(own, layers)
            )
        if len(chains) > 1:
            listed = "; ".join(f"{names[0]} … {names[-1]}" for _, names in chains)
            raise PolicyError(f"{source}: expected one chain of linear layers, found {len(chains)}: {listed}")
    raise PolicyError(
        f"{source}: expected layers 'NAME.weight' of shape (outputs, inputs), "
        f"found {describe_tensors(tensors)}"
    )


def _find_chains(tensors: Tensors) -> list[tuple[tuple[LinearLayer, ...], list[str]]]:
    """Return successive layers as chains; a layer whose inputs do not fit begins a new one."""
    chains: list[tuple[tuple[LinearLayer, ...], list[str]]] = []
    for name in _ordered_layer_names(tensors):
        layer = read_linear_layer(tensors, name)
        if chains and chains[-1][0][-1].shape[0] == layer.shape[1]:
            layers, names = chains.pop()
            chains.append(((*layers, layer), [*names, name]))
        else:
            chains.append(((layer,), [name]))
    return [chain for chain in chains if len(chain[0]) > 1]


def _ordered_layer_names(tensors: Tensors) -> list[str]:
    weights = [name for name, tensor in tensors.items() if name.endswith(".weight") and tensor.ndim == 2]
    containers: dict[str, list[tuple[int, str]]] = {}
    for position, name in enumerate(name.removesuffix(".weight") for name in weights):
        match = _NUMBERED.fullmatch(name)
        container, number = (match[1], int(match[2])) if match else (name, position)
        containers.setdefault(container, []).append((number, name))
    return [name for members in containers.values() for _, name in sorted(members)]


def _find_log_std(tensors: Tensors, layers: tuple[LinearLayer, ...]) -> torch.Tensor | None:
    actions = layers[-1].shape[0]
    for name, tensor in tensors.items():
        if _LOG_STD.fullmatch(name) and tensor.numel() == actions and tensor.is_floating_point():
            return tensor
    return None
