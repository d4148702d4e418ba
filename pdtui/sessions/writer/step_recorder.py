"""What records control steps, in this process or in another."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from pdtui.core.step_record import StepRecord


class StepRecorder(Protocol):
    """Records a drive; `SessionRecorder` says what each member means."""

    notice: str

    @property
    def path(self) -> Path: ...

    @property
    def on_disk(self) -> bool: ...

    @property
    def created(self) -> str: ...

    @property
    def bytes(self) -> int: ...

    def write(self, record: StepRecord) -> None: ...

    def close(self, outcome: str) -> None: ...
