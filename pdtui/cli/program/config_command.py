"""`pdtui config`: the user's settings, with their defaults and what they do."""

from __future__ import annotations

import click

from pdtui.core.printable_text import make_printable


@click.command()
@click.option("--path", "only_path", is_flag=True, help="Print only where the file of the settings is.")
def config_command(only_path: bool) -> None:
    """Print the settings, with their defaults and what they do.

    The output is a settings file: save it where --path says, and change in it what you like. Options on the
    command line override it.
    """
    from pdtui.core.settings.settings_file import read_settings, settings_path
    from pdtui.core.settings.settings_text import describe_settings

    path = settings_path()
    if only_path:
        click.echo(make_printable(str(path)))
        return
    from pdtui.tui.themes.themed_app import list_themes, require_theme

    settings = read_settings()
    require_theme(settings.theme, f"{path}: theme")
    there = "" if path.exists() else ", which does not exist yet"
    click.echo(make_printable(f"# Settings of pdtui, in {path}{there}."))
    click.echo("# What is commented out has its default.\n")
    click.echo(describe_settings(settings, {"theme": list(list_themes())}), nl=False)
