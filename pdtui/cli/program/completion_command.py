"""`pdtui completion`: completion of commands, options and names in the shell."""

from __future__ import annotations

import click

from pdtui.cli.completion.shell_scripts import SHELLS, write_completion_script


@click.command()
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def completion_command(context: click.Context, shell: str) -> None:
    """Print the script that makes SHELL complete commands, options, robots, maps, behaviors and sessions.

    Bash: pdtui completion bash > ~/.local/share/bash-completion/completions/pdtui

    Zsh: pdtui completion zsh > "${fpath[1]}/_pdtui"

    Fish: pdtui completion fish > ~/.config/fish/completions/pdtui.fish
    """
    click.echo(write_completion_script(context.find_root().command, shell))
