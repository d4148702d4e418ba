"""Interprets the code of a TorchScript archive, so that the outputs of its submodules can be read."""

from __future__ import annotations

import ast
import copy
from collections.abc import Mapping
from typing import Any

import torch
from torch import nn

from pdtui.core.errors import PolicyError
from pdtui.policies.foreign.pickle_reader import PickledObject
from pdtui.policies.runtime.fast_mlp import ACTIVATION_TYPES
from pdtui.policies.torchscript.forward_pass_budget import ForwardPassBudget
from pdtui.policies.torchscript.torchscript_operators import apply_torch_operator

_RECURRENT = ("LSTM", "GRU", "RNN", "LSTMCell", "GRUCell", "RNNCell")
_UNITS = {*_RECURRENT, *(kind.__name__ for kind in ACTIVATION_TYPES)}
_CASTS: dict[str, Any] = {"int": int, "float": float, "bool": bool}
_FAILURES = (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)
"""What code may raise that a file brought along."""


class TorchScriptProgram:
    """The functions and methods in the source code of an archive (text by module), by their full names."""

    def __init__(self, texts: Mapping[str, str], constants: tuple[Any, ...]) -> None:
        self.functions: dict[str, ast.FunctionDef] = {}
        self.fields: dict[str, dict[str, Any]] = {}
        self.constants = constants
        self.budget = ForwardPassBudget()
        self.depth = 0
        for module, text in texts.items():
            try:
                body = ast.parse(text).body
            except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
                raise PolicyError(f"code '{module}': not TorchScript: {error}") from error
            for node in body:
                self._define(module, node)

    def _define(self, module: str, node: ast.stmt) -> None:
        if isinstance(node, ast.FunctionDef):
            self.functions[f"{module}.{node.name}"] = node
        elif isinstance(node, ast.ClassDef):
            kind = f"{module}.{node.name}"
            for part in node.body:
                if isinstance(part, ast.FunctionDef):
                    self.functions[f"{kind}.{part.name}"] = part
                elif isinstance(part, ast.AnnAssign) and part.value and isinstance(part.target, ast.Name):
                    self.fields.setdefault(kind, {})[part.target.id] = ast.literal_eval(part.value)

    def call(self, name: str, arguments: list[Any], keywords: dict[str, Any] | None = None) -> Any:
        """Run a function of the archive."""
        function = self.functions.get(name)
        if function is None:
            raise PolicyError(f"its code has no '{name[:100]}'")
        names, defaults = [one.arg for one in function.args.args], function.args.defaults
        values = dict(zip(names[len(names) - len(defaults) :], map(ast.literal_eval, defaults), strict=True))
        values |= dict(zip(names, arguments, strict=False)) | (keywords or {})
        if self.depth == 0:
            self.budget.begin()
        self.depth += 1
        try:
            return _StackFrame(self, values).run(function.body)
        finally:
            self.depth -= 1

    def __deepcopy__(self, memo: dict[int, Any]) -> TorchScriptProgram:
        """Return a program that counts its own passes; the code, which never changes, is shared."""
        other = memo[id(self)] = copy.copy(self)
        other.budget, other.constants = ForwardPassBudget(), copy.deepcopy(self.constants, memo)
        return other


class InterpretedModule(nn.Module):
    """A submodule of the archive, whose methods are interpreted."""

    def __init__(
        self, pickled: PickledObject, program: TorchScriptProgram, built: dict[int, InterpretedModule]
    ) -> None:
        super().__init__()
        built[id(pickled)] = self
        self.kind, self._program = pickled.kind, program
        self._plain: dict[str, Any] = dict(program.fields.get(pickled.kind, {}))
        self.is_activation = pickled.kind.rpartition(".")[2] in _UNITS
        for name, value in pickled.attributes.items():
            if isinstance(value, PickledObject):
                known = built.get(id(value))
                self.add_module(name, known or InterpretedModule(value, program, built))
            elif isinstance(value, torch.Tensor) and value.is_floating_point():
                self.register_parameter(name, nn.Parameter(value, requires_grad=False))
            elif isinstance(value, torch.Tensor):
                self.register_buffer(name, value)
            else:
                self._plain[name] = False if name == "training" else value

    def forward(self, *arguments: Any, method: str = "forward") -> Any:
        if f"{self.kind}.{method}" not in self._program.functions:
            raise PolicyError(f"its class '{self.kind}' has no method '{method}'")
        try:
            return self.run(method, list(arguments))
        except _FAILURES as error:
            if self._program.depth:
                raise
            shapes = ", ".join(str(tuple(one.shape)) for one in arguments if isinstance(one, torch.Tensor))
            reason = str(error).strip().partition("\n")[0][:200] or type(error).__name__
            raise PolicyError(f"its code fails when it is given {shapes}: {reason}") from error

    def run(self, method: str, arguments: list[Any], keywords: dict[str, Any] | None = None) -> Any:
        """Run a method of the submodule."""
        return self._program.call(f"{self.kind}.{method}", [self, *arguments], keywords)

    def read(self, name: str) -> Any:
        """Return an attribute of the submodule."""
        for table in (self._plain, self._modules, self._parameters, self._buffers):
            if name in table:
                return table[name]
        raise PolicyError(f"its class '{self.kind}' has no attribute '{name[:80]}'")


class _Function(str):
    """The full name of a function that is held in a variable."""


class _Return(Exception): ...  # noqa: N818 - it carries a value


class _StackFrame:
    def __init__(self, program: TorchScriptProgram, values: dict[str, Any]) -> None:
        self._program, self._values = program, values

    def run(self, body: list[ast.stmt]) -> Any:
        try:
            self._run_block(body)
        except _Return as done:
            return done.args[0]
        return None

    def _run_block(self, body: list[ast.stmt]) -> None:
        for node in body:
            self._program.budget.count_evaluated_expression()
            match node:
                case ast.Return():
                    raise _Return(None if node.value is None else self._evaluate(node.value))
                case ast.Assign(targets=[target]):
                    self._assign(target, self._evaluate(node.value))
                case ast.AnnAssign(value=ast.expr() as value):
                    self._assign(node.target, self._evaluate(value))
                case ast.If():
                    self._run_block(node.body if self._evaluate(node.test) else node.orelse)
                case ast.Expr():
                    self._evaluate(node.value)
                case ast.Pass():
                    pass
                case _:
                    kind = type(node).__name__
                    raise PolicyError(f"its code has a statement '{kind}', which pdtui does not run")

    def _assign(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Tuple | ast.List):
            for one, part in zip(target.elts, value, strict=True):
                self._assign(one, part)
        elif isinstance(target, ast.Name):
            self._values[target.id] = value
        else:
            raise PolicyError("its code changes an attribute, which pdtui does not do for a file")

    def _evaluate(self, node: ast.expr) -> Any:  # noqa: PLR0912 - one case per kind of expression
        self._program.budget.count_evaluated_expression()
        match node:
            case ast.Constant():
                return node.value
            case ast.Name():
                if node.id not in self._values:
                    raise PolicyError(f"its code reads '{node.id[:80]}' before it is set")
                return self._values[node.id]
            case ast.Tuple():
                return tuple(self._evaluate(one) for one in node.elts)
            case ast.List():
                return [self._evaluate(one) for one in node.elts]
            case ast.UnaryOp(op=ast.USub()):
                return -self._evaluate(node.operand)
            case ast.IfExp():
                return self._evaluate(node.body if self._evaluate(node.test) else node.orelse)
            case ast.Subscript():
                owner, place = self._evaluate(node.value), self._evaluate(node.slice)
                if isinstance(owner, list | tuple) and isinstance(place, int):
                    return owner[place]
            case ast.Attribute(value=ast.Name(id="CONSTANTS")):
                return self._program.constants[int(node.attr.removeprefix("c"))]
            case ast.Attribute() if _dotted_name(node).startswith("__torch__."):
                return _Function(_dotted_name(node))
            case ast.Attribute():
                owner = self._evaluate(node.value)
                if isinstance(owner, InterpretedModule):
                    return owner.read(node.attr)
            case ast.Call():
                return self._call(node)
        raise PolicyError(f"its code says '{ast.unparse(node)[:80]}', which pdtui does not run")

    def _call(self, node: ast.Call) -> Any:
        name = _dotted_name(node.func)
        if name in ("annotate", "unchecked_cast"):
            return self._evaluate(node.args[1])
        if name == "uninitialized":
            return None
        arguments = [self._evaluate(one) for one in node.args]
        keywords = {one.arg: self._evaluate(one.value) for one in node.keywords if one.arg is not None}
        if name == "getattr" and isinstance(arguments[0], InterpretedModule):
            return arguments[0].read(str(arguments[1]))
        if name in _CASTS and isinstance(arguments[0], int | float | torch.Tensor):
            return _CASTS[name](arguments[0])
        if name.startswith("ops.prim."):
            return _call_primitive(name.removeprefix("ops.prim."), arguments)
        if name.startswith("torch."):
            return apply_torch_operator(
                name.removeprefix("torch."), arguments, keywords, self._program.budget
            )
        held = self._values.get(name)
        if name.startswith("__torch__.") or isinstance(held, _Function):
            return self._program.call(held or name, arguments, keywords)
        if isinstance(node.func, ast.Attribute) and not name.startswith("ops."):
            owner = self._evaluate(node.func.value)
            if isinstance(owner, InterpretedModule):
                method = node.func.attr
                # Called as a module, so that hooks see the output; forward__0 is an overload.
                if method.partition("__")[0] == "forward" and not keywords:
                    return owner(*arguments, method=method)
                return owner.run(method, arguments, keywords)
        raise PolicyError(f"its code calls '{ast.unparse(node.func)[:80]}', which pdtui does not do")


def _call_primitive(name: str, arguments: list[Any]) -> Any:
    if name == "NumToTensor":
        return torch.tensor(arguments[0])
    if name in ("dtype", "device") and isinstance(arguments[0], torch.Tensor):
        return getattr(arguments[0], name)
    if name == "RaiseException":
        raise PolicyError(f"its code says: {str(arguments[0])[:200]}")
    raise PolicyError(f"its code uses 'prim::{name[:80]}', which pdtui does not run")


def _dotted_name(node: ast.expr) -> str:
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    return ".".join([node.id, *reversed(parts)]) if isinstance(node, ast.Name) else ""
