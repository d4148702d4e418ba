"""TorchScript archives that would take a machine's memory and time, read or run."""

from __future__ import annotations

import struct
from collections.abc import Callable

from tests.hostile_archives import tensor_opcodes, torchscript, understated_zip, zip_bomb, zipped

_NETWORK = """\
class Net(Module):
  __parameters__ = []
  __buffers__ = []
  def forward(self: __torch__.Net,
    x: Tensor) -> Tensor:
{body}
    return x
"""


def _network(*statements: str, more: str = "") -> bytes:
    """A TorchScript archive whose network does this."""
    body = "\n".join(f"    {statement}" for statement in statements)
    return torchscript(more + _NETWORK.format(body=body))


def _doubling_functions() -> str:
    functions = ["def f0(x: Tensor) -> Tensor:\n  return torch.tanh(x)\n"]
    for number in range(1, 60):
        call = f"__torch__.f{number - 1}"
        functions.append(f"def f{number}(x: Tensor) -> Tensor:\n  return {call}({call}(x))\n")
    return "".join(functions)


TORCHSCRIPT: dict[str, Callable[[], bytes]] = {
    "a tensor of stride 0": lambda: torchscript(
        _NETWORK.format(body="    pass"), {"w": tensor_opcodes((32768, 32768), (0, 0), 1)}, numbers=1
    ),
    "ones": lambda: _network("y = torch.ones([30000, 30000])"),
    "many ones": lambda: _network(*(f"y{n} = torch.ones([4000, 4000])" for n in range(100))),
    "an expanded number": lambda: _network(
        "y = torch.expand(torch.ones([1]), [8000, 8000])", "z = torch.exp(y)"
    ),
    "squarings": lambda: _network("y = torch.ones([4000, 4000])", *["y = torch.mm(y, y)"] * 45),
    "products of integers": lambda: _network(
        "y = torch.ones([2000, 2000], dtype=4)", *["y = torch.mm(y, y)"] * 45
    ),
    "powers": lambda: _network("y = torch.ones([3000, 3000])", *["y = torch.pow(y, 0.3)"] * 500),
    "an empty product": lambda: _network("y = torch.mm(torch.ones([30000, 0]), torch.ones([0, 30000]))"),
    "an outer product": lambda: _network("a = torch.ones([2000])", 'y = torch.einsum("i,j,k->", [a, a, a])'),
    "products of many matrices": lambda: _network(
        "y = torch.matmul(torch.ones([1000, 1, 1, 1000]), torch.ones([1, 1000, 1000, 1]))"
    ),
    "a large kernel": lambda: _network(
        "y = torch.conv2d(torch.ones([1, 1, 3000, 3000], dtype=7), torch.ones([1, 1, 30, 30], dtype=7))"
    ),
    "a large window": lambda: _network(
        "y = torch.max_pool2d(torch.ones([1, 1, 3000, 3000]), [999, 999], [1, 1])"
    ),
    "a long sequence": lambda: _network(
        "w = torch.ones([4, 1])",
        "b = torch.ones([4])",
        "h = torch.ones([1, 1, 1])",
        "y = torch.lstm(torch.ones([3000000, 1, 1]), [h, h], [w, w, b, b], "
        "True, 1, 0.0, False, False, False)",
    ),
    "a million parts": lambda: _network("y = torch.unbind(torch.ones([4000000]))"),
    "functions that double": lambda: _network("x = __torch__.f59(x)", more=_doubling_functions()),
    "lists that double": lambda: _network("y = [x, x]", *["y = [y, y]"] * 60, 'z = torch.format("{}", y)'),
    "lists that are compared": lambda: _network(
        "y = [1, 1]", "z = [1, 1]", *["y = [y, y]", "z = [z, z]"] * 60, "w = torch.eq(y, z)"
    ),
    "a function that calls itself": lambda: _network(
        "x = __torch__.f(x)", more="def f(x: Tensor) -> Tensor:\n  return __torch__.f(x)\n"
    ),
    "an f-string": lambda: _network("y = f'" + "{x}" * 80_000 + "'"),
    "a long program": lambda: _network(*["x"] * 120_000),
    "a deep program": lambda: _network("y = " + "+".join(["x"] * 60_000)),
    "minus signs": lambda: _network("y = " + "-" * 100_000 + "x"),
    "an endless integer": lambda: _network("y = " + "9" * 100_000),
    "lists in lists": lambda: torchscript(
        _NETWORK.format(body="    pass"), {"w": b"]" + b"q\x01(h\x01h\x01e" * 30}
    ),
    "lists that share": lambda: torchscript(
        _NETWORK.format(body="    pass"),
        {f"w{n}": b"]q%c(h%ch%ce" % (n, n - 1, n - 1) if n else b"]q\x00" for n in range(60)},
    ),
    "a long pickle": lambda: zipped(
        {"net/data.pkl": b"\x80\x02" + b"N" * 20_000_000 + b".", "net/code/__torch__.py": b""}
    ),
    "an integer of a million bytes": lambda: torchscript(
        _NETWORK.format(body="    pass"), {"w": b"\x8b" + struct.pack("<i", 900_000) + b"\x7f" * 900_000}
    ),
    "code that unpacks to more": lambda: zip_bomb("net/code/__torch__.py", 2400 << 20),
    "code that lies about its size": lambda: understated_zip("net/code/__torch__.py", 800 << 20),
    "many entries": lambda: zipped({f"net/code/__torch__/{n}.py": b"" for n in range(150_000)}),
    "many modules": lambda: torchscript(
        _NETWORK.format(body="    pass"), {f"m{n}": b"c__torch__\nNet\n)\x81}b" for n in range(20_000)}
    ),
}
