"""Check a whole file by its checksums, without decoding anything."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pdtui.core.errors import SessionError
from pdtui.sessions.rrd.message_framing import check_rrd_start, open_rrd_file
from pdtui.sessions.rrd.message_reader import MessageReader


@dataclass(frozen=True)
class FileCheck:
    """What the checksums of a file say.

    Attributes:
        sealed: whether the messages have checksums.
        finished: whether the file ends with its last message.
        messages: number of messages, except the last.
        checksum: checksum of the last message that has one.
        damage: what is wrong first, with its byte; empty if every checksum matches, in an unbroken chain.
    """

    sealed: bool
    finished: bool
    messages: int
    checksum: int
    damage: str


def check_file(path: Path) -> FileCheck:
    """Read a file from beginning to end and compare every checksum.

    Raises:
        SessionError: the file does not exist or cannot be read.
    """
    with open_rrd_file(path) as (file, size):
        reader = MessageReader(file, size)
        damage = ""
        try:
            file.seek(0)
            check_rrd_start(file)
            for _ in reader:
                pass
        except SessionError as error:
            damage = str(error)
        return FileCheck(reader.sealed, reader.finished, reader.messages, reader.checksum, damage)
