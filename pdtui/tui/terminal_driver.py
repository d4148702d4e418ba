"""The link to the terminal, which survives whatever a terminal sends."""

from __future__ import annotations

import os
import select
from codecs import getincrementaldecoder
from collections.abc import Callable, Iterable
from contextlib import suppress

from textual._xterm_parser import BRACKETED_PASTE_END, BRACKETED_PASTE_START, XTermParser
from textual.drivers.linux_driver import LinuxDriver
from textual.events import Key
from textual.message import Message

_WAIT = 0.1
"""Longest wait for input, s; after it, an escape that nothing has followed is the escape key."""
_CHUNK = 4096


class TerminalDriver(LinuxDriver):
    """Textual's driver, except that input which cannot be understood is dropped and ends nothing.

    Bytes that are not UTF-8 (of a terminal set to another encoding, or of a mouse that reports in the oldest
    form) and numbers of keys that are no characters would otherwise end the application.
    """

    def _get_terminal_size(self) -> tuple[int, int]:
        """Ask the terminal; Textual would believe COLUMNS and LINES, which a shell that exports them never
        changes when its window does.
        """
        with suppress(OSError):
            columns, lines = os.get_terminal_size(self.fileno)
            if columns and lines:
                return columns, lines
        return super()._get_terminal_size()

    def write(self, data: str) -> None:
        """Write to the terminal; once it is gone, Textual would wait for its writer, which has died."""
        if self._writer_thread is not None and self._writer_thread.is_alive():
            super().write(data)

    def run_input_thread(self) -> None:
        """Read input until the application ends, and send it keys, clicks and pasted text."""
        decode = getincrementaldecoder("utf-8")(errors="replace").decode
        reader = TerminalInputParser(self.process_message)
        while not self.exit_event.is_set():
            if select.select([self.fileno], [], [], _WAIT)[0]:
                try:
                    received = os.read(self.fileno, _CHUNK)
                except OSError:
                    return
                if not received:
                    return  # the terminal is gone, and this thread must not keep the process alive
                reader.feed(decode(received))
            reader.tick()


class TerminalInputParser:
    """Turns what a terminal sends into messages, and goes on after what is no message.

    Args:
        send: called with each message.
    """

    def __init__(self, send: Callable[[Message], None]) -> None:
        self._send, self._parser = send, XTermParser()
        self._latest = ""
        self._pasted: list[str] | None = None

    def feed(self, text: str) -> None:
        """Send the messages that end in this text."""
        # One by one, so that a character that ends nonsense takes none of those after it along.
        for character in text:
            self._latest = (self._latest + character)[-len(BRACKETED_PASTE_START) :]
            if self._pasted is None:
                self._send_all(self._parser.feed(character))
                if self._latest == BRACKETED_PASTE_START:
                    self._pasted = []
                continue
            self._pasted.append(character)
            if self._latest == BRACKETED_PASTE_END:
                # The parser would take an escape in pasted text for the beginning of a key.
                pasted = "".join(self._pasted[: -len(BRACKETED_PASTE_END)]).replace("\x1b", "")
                self._pasted = None
                self._send_all(self._parser.feed(pasted + BRACKETED_PASTE_END))

    def tick(self) -> None:
        """Send what was waiting for more input, if it has waited long enough."""
        if self._pasted is None:
            self._send_all(self._parser.tick())

    def _send_all(self, messages: Iterable[Message]) -> None:
        try:
            for message in messages:  # which are parsed one by one
                if isinstance(message, Key):
                    message.key.encode()  # half a character has a key, but no screen can show it
                self._send(message)
        except (ValueError, ArithmeticError, LookupError):
            self._parser = XTermParser()
