"""Replace files atomically: a reader finds the old content or all of the new, never a part of it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pdtui.core.errors import PdtuiError


@contextmanager
def replace_file(path: Path, error: type[PdtuiError]) -> Iterator[Path]:
    """Yield a temporary path beside `path`; the file written there replaces `path` when the block ends.

    If the block raises, `path` stays as it was and the temporary file is removed. A symbolic link stays a
    link: its target is replaced, and keeps its permissions. A device or a pipe is written to directly.

    Args:
        path: the file; its folder is made.
        error: the class of error that an `OSError` in the block or the replacement is turned into.

    Raises:
        error: the file cannot be written; the message names it.
    """
    with _named_errors(path, error):
        target = path.resolve()
        if target.exists() and not target.is_file():
            yield target
            return
        partial = _create_partial(target)
        try:
            yield partial
            if target.exists():
                partial.chmod(target.stat().st_mode & 0o777)
            with partial.open("rb") as file:
                os.fsync(file.fileno())  # else a power failure may leave an empty file under the final name
            partial.replace(target)
        finally:
            partial.unlink(missing_ok=True)


def write_file(path: Path, content: str | bytes, error: type[PdtuiError]) -> None:
    """Replace a file by text (as UTF-8) or bytes, as `replace_file` does, with the same errors."""
    with replace_file(path, error) as partial:
        partial.write_bytes(content.encode() if isinstance(content, str) else content)


def check_writable(path: Path, error: type[PdtuiError]) -> None:
    """Find out before long work whether `replace_file` can write a file; if not, raise its `error`."""
    with _named_errors(path, error):
        target = path.resolve()
        if target.is_file() or not target.exists():
            _create_partial(target).unlink()


def _create_partial(target: Path) -> Path:
    """Create the empty file that is written first, in the folder of the target."""
    target.parent.mkdir(parents=True, exist_ok=True)
    # The process's number keeps two programs that write the same file apart.
    partial = target.with_name(f".{target.name}.{os.getpid()}.part")
    partial.unlink(missing_ok=True)
    partial.touch(exist_ok=False)
    return partial


@contextmanager
def _named_errors(path: Path, error: type[PdtuiError]) -> Iterator[None]:
    try:
        yield
    except OSError as cause:
        raise error(f"{path}: cannot be written: {cause.strerror or cause}") from cause
