"""Assembly of a network from what its file states, the import options and the world's spaces."""

from __future__ import annotations

import torch

from pdtui.core.errors import PolicyError
from pdtui.policies.importers.partial_policy import PartialPolicy
from pdtui.policies.weights.import_options import (
    ACTIVATION_NAMES,
    SQUASH_NAMES,
    ImportOptions,
    ObservationActionSpaces,
)
from pdtui.policies.weights.policy_network import Head, NetworkSpec, PolicyNetwork


def assemble_network(
    found: PartialPolicy, import_options: ImportOptions, spaces: ObservationActionSpaces | None, source: str
) -> PolicyNetwork:
    """Return the network of a policy, completed by the options and the world's spaces.

    Raises:
        PolicyError: The shapes do not fit the world; or something is open, and the message names the option.
    """
    if len(found.layers) < 2:
        raise PolicyError(
            f"{source}: expected a hidden layer before the head, found {len(found.layers)} layers"
        )
    output = _output_kind(found, spaces, source)
    outputs, observations = found.layers[-1].shape[0], found.layers[0].shape[1]
    actions = outputs // 2 if output == "gaussian pair" else outputs
    discrete = output == "categorical"
    if spaces is not None:
        spaces.check(source, observations, 1 if discrete else actions, actions if discrete else 0)
    head, squash = _choose_head(found, output, import_options, source)
    low, high = _action_bounds(found, squash, spaces, actions, source) if not discrete else ((), ())
    spec = NetworkSpec(
        robot="",
        observations=observations,
        layers=tuple(layer.shape[0] for layer in found.layers[:-1]),
        activation=_choose_activation(found, import_options, source),
        actions=actions,
        head=head,
        action_low=low,
        action_high=high,
        command=f"imported from {found.origin}",
        log_std="parameter" if found.log_std is not None else "output",
        log_std_low=found.log_std_low,
        log_std_high=found.log_std_high,
        log_std_rule=found.log_std_rule,
        mean_limit=found.mean_limit,
        observation_clip=found.statistics.clip if found.statistics else 0.0,
    )
    network = PolicyNetwork(spec)
    network.load_tensors(_network_tensors(found, network, source))
    return network.eval()


def _output_kind(found: PartialPolicy, spaces: ObservationActionSpaces | None, source: str) -> str:
    """Return what the head's outputs are; the world's spaces decide where the file does not say."""
    if found.output != "unknown pair":
        return found.output
    outputs = found.layers[-1].shape[0]
    if spaces is None:
        raise PolicyError(
            f"{source}: {found.origin} does not say whether its {outputs} outputs are actions, pairs of mean "
            "and deviation, or logits; name the robot that it drives (--robot)"
        )
    if spaces.discrete_actions:
        return "categorical"
    return "gaussian pair" if outputs == 2 * spaces.actions else "action"


def _choose_head(
    found: PartialPolicy, output: str, import_options: ImportOptions, source: str
) -> tuple[Head, str]:
    if output == "categorical":
        return "categorical", "none"
    squash = import_options.squash or found.squash
    if not squash:
        raise PolicyError(
            f"{source}: {found.origin} does not say how outputs become actions; choose with --squash "
            f"{'|'.join(SQUASH_NAMES)}: none takes them as they are, tanh squashes them into the bounds, "
            "clip clips them to the bounds"
        )
    drawn = output == "gaussian pair" or found.log_std is not None
    if squash == "tanh":
        return ("squashed_gaussian" if drawn else "tanh"), squash
    return ("gaussian" if drawn else "mean"), squash


def _action_bounds(
    found: PartialPolicy, squash: str, spaces: ObservationActionSpaces | None, actions: int, source: str
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    if squash == "none":
        return (), ()
    low, high = found.low, found.high
    if not low and spaces is not None:
        low, high = spaces.low, spaces.high
    if not low:
        raise PolicyError(
            f"{source}: {found.origin} does not hold the bounds of the {actions} actions, which --squash "
            f"{squash} needs, and no world gave them; --squash none takes outputs as they are"
        )
    if len(low) != actions or len(high) != actions:
        raise PolicyError(f"{source}: expected bounds of {actions} actions, found {len(low)} and {len(high)}")
    return low, high


def _choose_activation(found: PartialPolicy, import_options: ImportOptions, source: str) -> str:
    if activation := import_options.activation or found.activation:
        return activation
    raise PolicyError(
        f"{source}: {found.origin} does not say the activation function of its "
        f"{len(found.layers) - 1} hidden layers; choose with --activation {'|'.join(ACTIVATION_NAMES)}"
    )


def _network_tensors(found: PartialPolicy, network: PolicyNetwork, source: str) -> dict[str, torch.Tensor]:
    tensors = dict(network.state_dict())
    for number, layer in enumerate(found.layers[:-1]):
        tensors[f"hidden.{number}.weight"], tensors[f"hidden.{number}.bias"] = layer.weight, layer.bias
    tensors["head.weight"], tensors["head.bias"] = found.layers[-1].weight, found.layers[-1].bias
    if "log_std" in tensors and found.log_std is not None:
        tensors["log_std"] = found.log_std.reshape(-1).float()
    if found.statistics is not None:
        tensors["normalizer.mean"] = found.statistics.mean.float()
        tensors["normalizer.std"] = found.statistics.std.float()
        if bool((found.statistics.std <= 0).any()):
            what = "statistics of the observation"
            raise PolicyError(f"{source}: {what}: expected positive standard deviations")
    return tensors
