"""The link to a browser, in which several applications may run one after the other."""

from __future__ import annotations

import atexit
import os
from functools import partial
from typing import Any, ClassVar

from textual.app import App
from textual.drivers.web_driver import WebDriver

_PRELUDE = b"__GANGLION__\n"


class BrowserDriver(WebDriver):
    """Textual's driver for textual-serve, except that the page stays when an application ends.

    The home screen, what it opens, and the home screen again are applications in one process. The server
    expects a prelude once, and closes the page when it is told of an exit, which is when the process ends.
    """

    _begun: ClassVar[bool] = False
    _output: ClassVar[int] = -1
    _latest_size: ClassVar[tuple[int, int] | None] = None

    def __init__(self, app: App[Any], *, debug: bool = False, mouse: bool = True, size: Any = None) -> None:
        super().__init__(app, debug=debug, mouse=mouse, size=size or BrowserDriver._latest_size)
        self.claim_output()
        self._write_bytes = partial(os.write, BrowserDriver._output)
        self._write = self._write_after_prelude  # type: ignore[assignment]

    @classmethod
    def claim_output(cls) -> None:
        """Keep standard output for the browser; whatever is printed goes to standard error from now on.

        A printed line among the packets would be taken for one of them. Call it before children are started.
        """
        if cls._output < 0:
            cls._output = os.dup(1)
            os.dup2(2, 1)

    def _write_after_prelude(self, data: bytes) -> int:
        if data == _PRELUDE:
            if BrowserDriver._begun:
                return 0
            BrowserDriver._begun = True
            atexit.register(self.write_meta, {"type": "exit"})
        return self._write_bytes(data)

    def on_meta(self, packet_type: str, payload: dict[str, object]) -> None:
        super().on_meta(packet_type, payload)
        if packet_type == "resize":
            BrowserDriver._latest_size = self._size

    def stop_application_mode(self) -> None:
        """Stop reading; the page stays for the next application."""
        self.exit_event.set()
        self._input_reader.close()
