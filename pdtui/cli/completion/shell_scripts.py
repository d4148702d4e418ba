"""The scripts that make a shell complete `pdtui`, and what Bash needs besides click's own."""

from __future__ import annotations

import re
from typing import Any

import click
from click.shell_completion import BashComplete, CompletionItem, add_completion_class, get_completion_class

VARIABLE = "_PDTUI_COMPLETE"
"""Environment variable by which the shell asks pdtui for completions, as click derives it from the name."""
SHELLS = ("bash", "zsh", "fish")


@add_completion_class
class QuotingBashComplete(BashComplete):
    """Bash takes completions as they are, so that a name of two words would become two arguments."""

    # Without -r, Bash would take the quoting away again.
    source_template = BashComplete.source_template.replace("read type value", "read -r type value")

    def format_completion(self, item: CompletionItem[Any]) -> str:
        value = item.value if item.type != "plain" else re.sub(r"([^\w@%+=:,./-])", r"\\\1", item.value)
        return f"{item.type},{value}"


def write_completion_script(program: click.Command, shell: str) -> str:
    """Return the script for a shell, one of `SHELLS`."""
    completer = get_completion_class(shell)
    assert completer is not None
    return completer(program, {}, "pdtui", VARIABLE).source()
