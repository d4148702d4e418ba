"""Files that are made to take a machine's memory and time, one for every way that has been thought of.

``python -m tests.hostile_files`` gives each to the command line and prints what it takes.
"""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tests.hostile_archives import (
    npy,
    safetensors_file,
    state_dict,
    tensor_opcodes,
    understated_zip,
    zip_bomb,
    zipped,
)
from tests.hostile_networks import TORCHSCRIPT


@dataclass(frozen=True)
class HostileFile:
    """A hostile file.

    Attributes:
        kind: What it claims to be.
        name: What is wrong with it.
        path: Where it is.
        arguments: Arguments of `pdtui` that read it.
    """

    kind: str
    name: str
    path: Path
    arguments: tuple[str, ...]


@dataclass(frozen=True)
class Reading:
    """What a command did.

    Attributes:
        code: Its exit code.
        error: What it wrote to standard error.
        memory: Most bytes that it, or a process that it started, had at a time.
        seconds: Time by the clock, s.
        processor: Time of processors, of all its processes together, s.
    """

    code: int
    error: str
    memory: int
    seconds: float
    processor: float


def run_pdtui(arguments: tuple[str, ...], patience: float = 300.0, prefix: tuple[str, ...] = ()) -> Reading:
    """Run the command line and measure it; one that hangs is killed after `patience` seconds."""
    with tempfile.TemporaryFile() as errors:
        begin = time.monotonic()
        command = [*prefix, sys.executable, "-m", "pdtui", *arguments]
        child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=errors)
        status = memory = 0
        while not (ended := os.wait4(child.pid, os.WNOHANG))[0]:
            memory = max(memory, _peak_memory(child.pid))
            if time.monotonic() - begin > patience:
                child.kill()
            time.sleep(0.01)
        _, status, used = ended
        child.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.monotonic() - begin
        errors.seek(0)
        text = errors.read().decode("utf-8", "replace")
    return Reading(child.returncode, text, memory, seconds, used.ru_utime + used.ru_stime)


def _peak_memory(pid: int) -> int:
    """Return the peak memory of a process and its children, the larger, so far; bytes.

    `getrusage` would count what this process had when it started the other.
    """
    peaks = [0]
    with suppress(OSError):
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        for one in (str(pid), *children):
            lines = Path(f"/proc/{one}/status").read_text().splitlines()
            peaks += [int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM")]
    return max(peaks)


SB3_DATA = b'{"policy_class": {"__module__": "stable_baselines3.x"}, "clip_range": 1}'
SB3: dict[str, Callable[[], bytes]] = {
    "a tensor of stride 0": lambda: zipped(
        {
            "data": SB3_DATA,
            "policy.pth": state_dict({"action_net.weight": tensor_opcodes((10**5, 10**5), (0, 0), 1)}),
        }
    ),
    "a sparse tensor": lambda: zipped(
        {"data": SB3_DATA, "policy.pth": state_dict({"w": b"ctorch._utils\n_rebuild_sparse_tensor\n)R"})}
    ),
    "brackets": lambda: zipped({"data": b"[" * 10_000_000, "policy.pth": b""}),
    "many lists": lambda: zipped({"data": b"[" + b"[]," * 5_000_000 + b"0]", "policy.pth": b""}),
    "tensors that unpack to more": lambda: zip_bomb("policy.pth", 2000 << 20, data=SB3_DATA),
    "tensors that lie about their size": lambda: understated_zip("policy.pth", 800 << 20, data=SB3_DATA),
    "a long bound": lambda: zipped(
        {"data": b'{"action_space": {"low": "' + b"1 " * 4_000_000 + b'"}}', "policy.pth": state_dict({})}
    ),
}
TORCH: dict[str, Callable[[], bytes]] = {
    "a tensor of stride 0": lambda: state_dict({"0.weight": tensor_opcodes((10**6, 10**6), (0, 0), 1)}),
    "a tensor of 10³⁰ numbers": lambda: state_dict(
        {"0.weight": tensor_opcodes((2**31 - 1, 0, 2**31 - 1), (1, 1, 1), 1)}
    ),
    "a negative stride": lambda: state_dict({"0.weight": tensor_opcodes((2, 2), (-1, 1), 4)}),
    "8,000 views of one storage": lambda: state_dict(
        {f"{n}.weight": tensor_opcodes((2048, 2048), (2048, 1), 2048 * 2048) for n in range(8_000)},
        numbers=2048 * 2048,
    ),
    "a quantized tensor": lambda: state_dict({"w": b"ctorch._utils\n_rebuild_qtensor\n)R"}),
    "a call": lambda: state_dict({"w": b"cos\nsystem\nX\x04\x00\x00\x00true\x85R"}),
    "a long pickle": lambda: zipped({"a/data.pkl": b"\x80\x02" + b"]" * 60_000_000 + b"."}),
    "one more file at its end": lambda: zipped({"a/data.pkl": b"\x80\x02}."}) + b"x" * (80 << 20),
}


def _header(descr: str = "<f4", shape: str = "(2, 2)") -> bytes:
    return f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}".encode()


NPZ: dict[str, Callable[[], bytes]] = {
    "a shape of negative sizes": lambda: zipped({"w.npy": npy(_header(shape="(-2, -3)"), bytes(24))}),
    "a shape of 10³⁰": lambda: zipped({"w.npy": npy(_header(shape=f"({10**30}, 0)"))}),
    "long doubles": lambda: zipped({"w.npy": npy(_header("<f16", "(1,)"), bytes(16))}),
    "a thousand dimensions": lambda: zipped({"w.npy": npy(_header(shape="(" + "1," * 1000 + ")"), bytes(4))}),
    "minus signs": lambda: zipped({"w.npy": npy(b"-" * 9000 + b"1")}),
    "brackets": lambda: zipped({"w.npy": npy(b"(" * 9000)}),
    "a header of a gigabyte": lambda: zipped({"w.npy": b"\x93NUMPY\x02\x00" + struct.pack("<I", 1 << 30)}),
    "a kind in kinds": lambda: zipped({"w.npy": npy(_header("(9999,9999)<f4"), bytes(16))}),
    "objects": lambda: zipped({"w.npy": npy(_header("|O", "(1,)"), b"cos\nsystem\n.")}),
    "an array that unpacks to more": lambda: zip_bomb("w.npy", 2000 << 20),
    "an array that lies about its size": lambda: understated_zip("w.npy", 800 << 20),
    "many arrays": lambda: zipped({f"l.{n}.weight.npy": npy(_header(), bytes(16)) for n in range(19_000)}),
    "a text as a name": lambda: zipped({"\u202e\x1b[2J.npy": npy(_header(), bytes(16))}),
}
SAFETENSORS: dict[str, Callable[[], bytes]] = {
    "a header of 60 MB": lambda: safetensors_file(b'{"a":"' + b"x" * (60 << 20) + b'"}'),
    "a shape of 20 million zeros": lambda: safetensors_file(
        b'{"a":{"dtype":"F32","shape":[' + b"0," * 20_000_000 + b'0],"data_offsets":[0,0]}}'
    ),
    "brackets": lambda: safetensors_file(b'{"a":' + b"[" * 1_000_000),
    "a header beyond the file": lambda: struct.pack("<Q", 1 << 62) + b'{"a":1}',
}
OWN: dict[str, Callable[[], bytes]] = {
    "a layer of 10⁹ units": lambda: _own_file({"layers": [10**9]}),
    "layers that are not there": lambda: _own_file({"layers": [1 << 20] * 50}),
    "an endless bound": lambda: _own_file({"action_low": [10**400] * 8}),
    "brackets": lambda: safetensors_file(json.dumps({"__metadata__": {"pdtui": "[" * 500_000}}).encode()),
    "a header of 90 MB": lambda: safetensors_file(
        json.dumps({"__metadata__": {"pdtui": "x" * (90 << 20)}}).encode()
    ),
    "a file of 2 GB": lambda: b"",
}


def _own_file(changed: dict[str, object]) -> bytes:
    fields = {
        "robot": "ant", "observations": 27, "layers": [4], "activation": "tanh", "actions": 8, "head": "tanh",
        "action_low": [-1.0] * 8, "action_high": [1.0] * 8,
    } | changed  # fmt: skip
    return safetensors_file(json.dumps({"__metadata__": {"pdtui": json.dumps(fields)}}).encode())


STATISTICS: dict[str, Callable[[], bytes]] = {
    "an endless number": lambda: b'{"mean": [' + b"1" + b"0" * 400 + b'], "var": [1]}',
    "a number of a million digits": lambda: b'{"mean": [' + b"9" * 1_000_000 + b'], "var": [1]}',
    "brackets": lambda: b'{"mean": ' + b"[" * 1_000_000,
    "a million names": lambda: json.dumps({f"n{n}": 0 for n in range(200_000)}).encode(),
    "lists of other lengths": lambda: b'{"mean": [[1], [1, 2]], "var": [1]}',
    "more than a file may have": lambda: b'{"mean": [' + b"0," * 10_000_000 + b"0]}",
    "a shape of negative sizes": NPZ["a shape of negative sizes"],
    "an array that lies about its size": lambda: understated_zip("mean.npy", 800 << 20),
}

_MAP = 'schema = 1\nrobot = "ant"\n[policy]\nname = "{policy}"\nsha256 = ""\n'
_BEHAVIOR = '[[behaviors]]\nname = "b{0}"\nkey = "k{0}"\nmagnitudes = {{ "0:1" = {1} }}\n{2}'


def _map(*more: str, policy: str = "ant") -> bytes:
    return (_MAP.format(policy=policy) + "".join(more)).encode()


MAPS: dict[str, Callable[[], bytes]] = {
    "a megabyte of behaviors": lambda: _map(*(_BEHAVIOR.format(n, 1.0, "") for n in range(16_000))),
    "too many behaviors": lambda: _map(*(_BEHAVIOR.format(n, 1.0, "") for n in range(3_500))),
    "a large behavior after a policy elsewhere": lambda: _map(
        "[[behaviors]]\nname = 'b'\nkey = 'b'\n[behaviors.magnitudes]\n",
        *(f'"0:{n}" = 1.0\n' for n in range(9_000)),
    ),
    "a period of 10³⁰⁸ s": lambda: _map(_BEHAVIOR.format(0, 1.0, "period = 1e308\n")),
    "an output of 10³⁰⁸": lambda: _map(_BEHAVIOR.format(0, 1e308, "")),
    "an endless number": lambda: _map(_BEHAVIOR.format(0, "9" * 5000, "")),
    "brackets": lambda: _map("x = " + "[" * 200_000),
    "dots": lambda: _map("a" + ".a" * 100_000 + " = 1\n"),
    "tables in tables": lambda: _map("".join(f"[{'a.' * 60}b{n}]\n" for n in range(1_900))),
    "newlines": lambda: b"\n" * 200_000_000,
    "as many behaviors as there may be": lambda: _map(*(_BEHAVIOR.format(n, 1.0, "") for n in range(1_000))),
    "as large as it may be": lambda: _map(
        *(f'[[primitives]]\nname="p{n}"\nattribute="vx"\nunit="0:1"\nrho=0.5\n' for n in range(900)),
        "[[behaviors]]\nname='b'\nkey='b'\n[behaviors.magnitudes]\n",
        *(f'"0:{n}" = 1.0\n' for n in range(4_096)),
        "# " + "x" * 120_000,
    ),
    "no text": lambda: os.urandom(100_000),
}
POLICY_NAMES: dict[str, Callable[[], bytes]] = {
    "250 characters": lambda: _map(_BEHAVIOR.format(0, 1.0, ""), policy="x" * 250),
    "900 characters": lambda: _map(_BEHAVIOR.format(0, 1.0, ""), policy="x/" * 450),
    "a pipe": lambda: _map(_BEHAVIOR.format(0, 1.0, ""), policy="/dev/stdin"),
}
KEYSTROKES: dict[str, Callable[[], bytes]] = {
    "a million keys in one step": lambda: b"0 x\n" * 1_000_000,
    "2.4 million keys in one step": lambda: b"0 x\n" * 2_400_000,
    "a million keys": lambda: b"".join(b"%d x\n" % (n // 50) for n in range(450_000)),
    "a long line": lambda: b"0 " + b"x" * 4_000_000,
    "spaces": lambda: b"0" + b" " * 4_000_000,
    "newlines": lambda: b"\n" * 4_000_000 + b"x",
    "no text": lambda: os.urandom(100_000),
}

_IMPORT = ("--activation", "tanh", "--squash", "none")


def _convert(path: Path) -> tuple[str, ...]:
    return "convert", str(path), "-o", str(path.with_suffix(".out.safetensors")), *_IMPORT


def _drive(*options: str) -> tuple[str, ...]:
    return "drive", "ant", *options, "--headless", "--steps", "2", "--no-record"


KINDS: dict[str, tuple[str, dict[str, Callable[[], bytes]], Callable[[Path], tuple[str, ...]]]] = {
    "torchscript": (".pt", TORCHSCRIPT, lambda path: _drive("--policy", str(path), "--force")),
    "stable-baselines3": (".zip", SB3, _convert),
    "torch": (".pt", TORCH, _convert),
    "npz": (".npz", NPZ, _convert),
    "safetensors": (".safetensors", SAFETENSORS, _convert),
    "weights": (".safetensors", OWN, lambda path: _drive("--policy", str(path), "--force")),
    "statistics": (
        ".json",
        STATISTICS,
        lambda path: (*_convert(path.with_name("plain.npz")), "--normalizer", str(path)),
    ),
    "map": (".toml", MAPS, lambda path: _drive("--map", str(path), "--policy", "nothing")),
    "name of a policy": (".toml", POLICY_NAMES, lambda path: _drive("--map", str(path))),
    "keystrokes": (".keys", KEYSTROKES, lambda path: _drive("--keys", str(path))),
}
"""Of each kind of file: how names end, what is hostile, and the arguments that read it."""


def write_hostile_file(folder: Path, kind: str, name: str) -> HostileFile:
    """Write one hostile file into a folder."""
    suffix, files, arguments = KINDS[kind]
    path = folder / f"{kind}-{list(files).index(name)}{suffix}"
    path.write_bytes(files[name]())
    if (kind, name) == ("weights", "a file of 2 GB"):
        path.write_bytes(_own_file({}))
        os.truncate(path, 2 << 30)
    if kind == "statistics":
        linear = {
            f"n.{n}.weight.npy": npy(_header(shape=s), bytes(b))
            for n, s, b in ((0, "(3, 2)", 24), (1, "(1, 3)", 12))
        }
        (folder / "plain.npz").write_bytes(zipped(linear))
    return HostileFile(kind, name, path, arguments(path))


def list_hostile_files() -> list[tuple[str, str]]:
    """Return the kind and the name of every hostile file."""
    return [(kind, name) for kind, (_, files, _) in KINDS.items() for name in files]


def write_hostile_files(folder: Path) -> Iterator[HostileFile]:
    """Write every hostile file into a folder, each when it is asked for."""
    for kind, name in list_hostile_files():
        yield write_hostile_file(folder, kind, name)


def main(*kinds: str) -> None:
    """Read every hostile file of these kinds, of all by default, and print what it takes."""
    with tempfile.TemporaryDirectory() as folder:
        for kind, name in list_hostile_files():
            if kinds and kind not in kinds:
                continue
            file = write_hostile_file(Path(folder), kind, name)
            size = file.path.stat().st_size
            found = run_pdtui(file.arguments)
            lines = len(found.error.splitlines())
            print(
                f"{kind:18} {name:42} {size:>11} bytes: code {found.code}, {found.memory >> 20:4d} MiB, "
                f"{found.seconds:5.1f} s ({found.processor:4.1f} s of processor), {lines} line(s): "
                f"{found.error[-150:].strip()}",
                flush=True,
            )
            file.path.unlink()


if __name__ == "__main__":
    main(*sys.argv[1:])
