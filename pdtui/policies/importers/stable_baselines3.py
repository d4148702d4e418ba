"""Stable-Baselines3 ``.zip`` files: PPO, A2C, SAC, TD3 and DDPG with an MlpPolicy.

The archive holds ``data``, JSON with readable fields beside pickles in base64, and ``policy.pth``, the
tensors. The pickles are ignored: beside each, Stable-Baselines3 writes the parts of the object as text, and
the activation function and the bounds of the action are read from there.
"""

from __future__ import annotations

import math
import re
from typing import Any

from torch import nn

from pdtui.core.errors import PolicyError
from pdtui.policies.foreign.reader_process import ForeignFile
from pdtui.policies.importers.partial_policy import (
    PartialPolicy,
    Tensors,
    check_layer_chain,
    describe_tensors,
    join_mean_and_deviation,
    read_layer_sequence,
    read_linear_layer,
    to_single_precision,
)
from pdtui.policies.weights.import_options import NO_NORMALIZER, ImportOptions
from pdtui.policies.weights.policy_network import ACTIVATIONS

_ORIGIN = "Stable-Baselines3 "
_CLASS = re.compile(r"<class '([\w.]+)'>")
_FUNCTION = re.compile(r"<function ([\w.<>]+)\.__init__ at")
OTHER_NETWORKS = "export such a network as TorchScript, or load it from Python"


def import_sb3(found: ForeignFile, import_options: ImportOptions) -> PartialPolicy:
    """Return the policy of a Stable-Baselines3 archive.

    The options tell whether the user gave the statistics of VecNormalize, which the archive lacks.
    """
    source, data = found.source, found.facts
    tensors = to_single_precision(found.tensors)
    _check_flat(tensors, data, source)
    if _is_normalized(data) and not import_options.normalizer:
        raise PolicyError(
            f"{source}: trained behind VecNormalize, whose statistics are another file: give them with "
            f"--normalizer FILE, or --normalizer {NO_NORMALIZER} if it normalized rewards only"
        )
    return _ArchiveReader(source, data, tensors).read_policy()


def _is_normalized(data: dict[str, Any]) -> bool:
    """Whether the model was trained behind VecNormalize, as far as the readable part of the file shows.

    PPO and A2C keep an unnormalized observation only behind VecNormalize. The off-policy algorithms always
    keep one; behind VecNormalize it is in double precision and the normalized one is not, so their texts
    differ in length. If the world observes in single precision, this cannot be detected.
    """
    own, seen = data.get("_last_original_obs"), data.get("_last_obs")
    if not isinstance(own, dict) or "buffer_size" not in data:
        return own is not None
    lengths = [part.get(":serialized:", 0) if isinstance(part, dict) else 0 for part in (own, seen)]
    return bool(lengths[0] != lengths[1])


class _ArchiveReader:
    def __init__(self, source: str, data: dict[str, Any], tensors: Tensors) -> None:
        self._source, self._data, self._tensors = source, data, tensors
        self._kwargs = _readable_parts(data, "policy_kwargs")
        self._actions = _readable_parts(data, "action_space")

    def read_policy(self) -> PartialPolicy:
        if "action_net.weight" in self._tensors:
            return self._actor_critic()
        if "actor.latent_pi.0.weight" in self._tensors:
            return self._sac()
        if "actor.mu.0.weight" in self._tensors:
            origin = _ORIGIN + ("DDPG" if str(self._kwargs.get("n_critics")) == "1" else "TD3")
            layers, activation = read_layer_sequence(self._tensors, "actor.mu"), self._activation("relu")
            return PartialPolicy(origin, layers, "action", activation, "tanh", *self._bounds())
        raise PolicyError(
            f"{self._source}: expected an actor of PPO, A2C, SAC, TD3 or DDPG, found "
            f"{_policy_class(self._data)} with tensors {describe_tensors(self._tensors)}"
        )

    def _actor_critic(self) -> PartialPolicy:
        origin = _ORIGIN + ("PPO" if "clip_range" in self._data else "A2C")
        hidden = read_layer_sequence(self._tensors, "mlp_extractor.shared_net") + read_layer_sequence(
            self._tensors, "mlp_extractor.policy_net"
        )
        layers = check_layer_chain([*hidden, read_linear_layer(self._tensors, "action_net")], "mlp_extractor")
        activation = self._activation("tanh")
        kind = str(self._actions.get(":type:", ""))
        if "MultiDiscrete" in kind or "MultiBinary" in kind:
            raise PolicyError(
                f"{self._source}: expected continuous actions or one discrete choice, found {kind}"
            )
        log_std = self._tensors.get("log_std")
        if log_std is None:
            return PartialPolicy(origin, layers, "categorical", activation)
        # State-dependent exploration has a matrix here, whose noise is no Gaussian of one step.
        drawn = log_std if log_std.ndim == 1 else None
        squashed = log_std.ndim == 2 and self._kwargs.get("squash_output") in (True, "True")
        squash = "tanh" if squashed else "none" if self._unbounded() else "clip"
        return PartialPolicy(origin, layers, "action", activation, squash, *self._bounds(), drawn)

    def _sac(self) -> PartialPolicy:
        hidden = read_layer_sequence(self._tensors, "actor.latent_pi")
        rest = self._activation("relu"), "tanh", *self._bounds()
        if "actor.log_std.weight" in self._tensors:
            head = join_mean_and_deviation(
                read_linear_layer(self._tensors, "actor.mu"),
                read_linear_layer(self._tensors, "actor.log_std"),
            )
            layers = check_layer_chain([*hidden, head], "actor")
            return PartialPolicy(_ORIGIN + "SAC", layers, "gaussian pair", *rest, log_std_high=2.0)
        limited = "actor.mu.0.weight" in self._tensors
        mean = read_linear_layer(self._tensors, "actor.mu.0" if limited else "actor.mu")
        limit = next(iter(_parse_numbers(self._kwargs.get("clip_mean"))), 2.0) if limited else 0.0
        layers = check_layer_chain([*hidden, mean], "actor")
        return PartialPolicy(_ORIGIN + "SAC", layers, "action", *rest, mean_limit=limit)

    def _activation(self, default: str) -> str:
        """Return what `policy_kwargs` says, else the default of Stable-Baselines3's own policy classes."""
        text = self._kwargs.get("activation_fn")
        if text is None:
            module = str(_readable_parts(self._data, "policy_class").get("__module__", ""))
            return default if module.startswith("stable_baselines3.") else ""
        match = _CLASS.fullmatch(str(text))
        kind = getattr(nn, match[1].rpartition(".")[2], None) if match else None
        # The user is asked for an activation function that is unknown, as for one that is not stated.
        return next((name for name, known in ACTIVATIONS.items() if known is kind), "")

    def _bounds(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the bounds of the action space; none where its text is abbreviated or says infinity."""
        low, high = (_parse_numbers(self._actions.get(side)) for side in ("low", "high"))
        return ((), ()) if self._unbounded() or len(low) != len(high) else (low, high)

    def _unbounded(self) -> bool:
        return any("inf" in str(self._actions.get(side, "")) for side in ("low", "high"))


def _policy_class(data: dict[str, Any]) -> str:
    match = _FUNCTION.search(str(_readable_parts(data, "policy_class").get("__init__", "")))
    return match[1] if match else "a policy of unknown class"


def _check_flat(tensors: Tensors, data: dict[str, Any], source: str) -> None:
    """Refuse networks that observe images or dictionaries, or that are recurrent."""
    for name, tensor in tensors.items():
        if "features_extractor." in name or "lstm" in name or tensor.ndim > 2:
            raise PolicyError(
                f"{source}: expected an MlpPolicy, found {_policy_class(data)} with tensor '{name}' of shape "
                f" {tuple(tensor.shape)}; {OTHER_NETWORKS}"
            )


def _readable_parts(data: dict[str, Any], name: str) -> dict[str, Any]:
    """Return the readable parts of a field, without its pickle."""
    value = data.get(name)
    parts = value.items() if isinstance(value, dict) else ()
    return {key: part for key, part in parts if key != ":serialized:"}


def _parse_numbers(text: Any) -> tuple[float, ...]:
    words = str("" if text is None else text).replace("[", " ").replace("]", " ").split()
    try:
        numbers = tuple(map(float, words))
    except ValueError:
        return ()
    return numbers if all(map(math.isfinite, numbers)) else ()
