"""The process that reads a file of another program, on its standard input, within its limits.

``python -m pdtui.policies.foreign CONTENT BYTES MEMORY SECONDS`` writes a safetensors file to its standard
output: the arrays, and everything else as JSON in the metadata. A refused file gives its reason there, and
the exit code `REFUSED`.
"""

from __future__ import annotations

import json
import math
import os
import resource
import signal
import sys
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from pdtui.core.errors import PolicyError
from pdtui.policies.foreign.file_kinds import FoundContent, read_policy_content, read_statistics_content
from pdtui.policies.foreign.reader_process import CONTENT_KEY, OUT_OF_MEMORY, REFUSED, WAIT_FACTOR

READERS = {"policy": read_policy_content, "statistics": read_statistics_content}
_MAX_MESSAGE = 1000
_DEEPEST = 500
"""Calls inside each other, so that a deeply nested file is an error before the stack ends."""


def limit_this_process(memory: int, seconds: float) -> None:
    """Have the system end this process if it exceeds these limits from now on."""
    with suppress(OSError, ValueError):  # where the system does not know such a limit
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
        # To the millisecond; to the second, too, in case the file can disable that timer.
        signal.setitimer(signal.ITIMER_PROF, seconds)
        used = resource.getrusage(resource.RUSAGE_SELF)
        processor = math.ceil(used.ru_utime + used.ru_stime + seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (processor, processor))
        with suppress(FileNotFoundError):  # only Linux says what a process has
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            addresses = pages * os.sysconf("SC_PAGE_SIZE") + memory
            resource.setrlimit(resource.RLIMIT_AS, (addresses, addresses))
    # On a busy machine, or should the parent be gone.
    signal.alarm(round(WAIT_FACTOR * seconds))


def pack_content(found: FoundContent, digest: str, limit: int) -> bytes:
    """Return what was read, as a safetensors file; arrays of more than `limit` bytes are a `PolicyError`."""
    if (size := sum(array.nbytes for array in found.arrays.values())) > limit:
        raise PolicyError(f"its tensors have {size} bytes together, expected at most {limit}")
    wide = {"u2": np.int64, "u4": np.int64, "u8": np.int64}
    # Names may be anything, so they are not put into the header of a safetensors file.
    arrays = {
        str(number): np.ascontiguousarray(array, wide.get(array.dtype.str[1:], array.dtype)).reshape(
            array.shape
        )
        for number, array in enumerate(found.arrays.values())
    }
    facts = {"form": found.form, "names": list(found.arrays), "sha256": digest, "facts": found.facts}
    return save(arrays, metadata={CONTENT_KEY: json.dumps(facts)})


def _shorten(message: str) -> bytes:
    """Return a message, which may quote the file, as one line of a bounded length."""
    return " ".join(message[:_MAX_MESSAGE].split()).encode("utf-8", "backslashreplace")


def main(content: str, limit: int, memory: int, seconds: float) -> int:
    """Read the file and write the answer; the exit code."""
    sys.setrecursionlimit(_DEEPEST)
    limit_this_process(memory, seconds)
    try:
        read = sys.stdin.buffer.read(limit + 1)
        if len(read) > limit:
            raise PolicyError(f"expected at most {limit} bytes, found more")
        digest = sha256(read).hexdigest()
        answer, code = pack_content(READERS[content](read, limit), digest, limit), 0
    except PolicyError as error:
        answer, code = _shorten(str(error)), REFUSED
    except RecursionError:
        answer, code = b"damaged: too deeply nested", REFUSED
    except MemoryError:
        return OUT_OF_MEMORY
    sys.stdout.buffer.write(answer)
    sys.stdout.buffer.flush()
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])))
