"""Serves the screen to a browser on this machine, at an address that has a secret in it."""

from __future__ import annotations

import asyncio
import errno
import logging
import secrets
import shlex
import signal
import sys
from collections.abc import Callable, Sequence

from aiohttp import web
from textual_serve.server import Server

from pdtui.core.errors import ScreenError

LOCAL = "127.0.0.1"
_PATIENCE = 2.0  # s for pages to close by themselves
_POLICY = "default-src 'self' data: 'unsafe-inline' ws://{host}:{port}; frame-ancestors 'none'"


class BrowserServer(Server):
    """Serves pdtui to whoever knows the address; each page that is opened has a process of its own.

    All paths lie below a token of 256 random bits, made anew for each server. Other paths are not found, so
    that neither another user of the machine nor a page of another site can press keys.

    Args:
        arguments: the command line of pdtui.
        port: port on `LOCAL`; 0 for any that is free.
    """

    port: int
    public_url: str

    def __init__(self, arguments: Sequence[str], port: int) -> None:
        command = shlex.join([sys.executable, "-m", "pdtui", *arguments])
        super().__init__(command, host=LOCAL, port=port, title="pdtui")
        self.token = secrets.token_urlsafe(32)

    @property
    def address(self) -> str:
        """The address to open."""
        return f"{self.public_url}/{self.token}/"

    def serve_until_ended(self, tell: Callable[[str], None]) -> None:
        """Serve until SIGINT or SIGTERM; `tell` gets the address once it can be opened.

        Raises:
            ScreenError: The port cannot be listened at.
        """
        # Each request that is logged would show the token.
        logging.basicConfig(level="WARNING", format="%(message)s")
        asyncio.run(self._serve(tell))

    async def _serve(self, tell: Callable[[str], None]) -> None:
        ended, loop = asyncio.Event(), asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, ended.set)
        runner = web.AppRunner(await self._make_app(), access_log=None, shutdown_timeout=_PATIENCE)
        await runner.setup()
        try:
            await web.TCPSite(runner, LOCAL, self.port).start()
            self.port = runner.addresses[0][1]
            self.public_url = f"http://{LOCAL}:{self.port}"
            tell(self.address)
            await ended.wait()
        except OSError as error:
            taken = "is taken by another program" if error.errno == errno.EADDRINUSE else str(error.strerror)
            raise ScreenError(f"port {self.port} of {LOCAL}: {taken}; --port N chooses another") from error
        finally:
            await runner.cleanup()

    async def _make_app(self) -> web.Application:
        outer = web.Application()
        outer.on_response_prepare.append(self._add_headers)
        outer.add_subapp(f"/{self.token}/", await super()._make_app())
        return outer

    async def on_startup(self, app: web.Application) -> None:
        """Say nothing yet: the address cannot be opened before the server listens."""

    async def _add_headers(self, _request: web.Request, response: web.StreamResponse) -> None:
        # The page wants a font from elsewhere, and nothing may tell elsewhere of the address.
        response.headers["Content-Security-Policy"] = _POLICY.format(host=LOCAL, port=self.port)
        response.headers["Referrer-Policy"] = "no-referrer"
        response.headers["Cache-Control"] = "no-store"
