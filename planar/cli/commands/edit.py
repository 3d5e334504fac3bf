"""The command `edit`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from planar.cli.options import SETTINGS, main, model_argument, read_model, refuse_settings
from planar.foundation.errors import BadInput


@main.command()
@model_argument(required=False)
@click.option("--no-browser", is_flag=True, help="Open no browser: only show the address of the page.")
def edit(model: str | None, no_browser: bool) -> None:
    """Draw a mechanism by hand, in the browser; the command ends when its page is closed.

    MODEL is a file, a model that comes along, or a link that the page has copied; left out, the paper is empty. The
    page is served on this machine alone. Only what is saved there is written: to the file, or beside it under another
    name.
    """
    from planar.pages.editor.server import EditServer

    value, path = _drawn_value(model)
    with EditServer(value, path, path.parent if path else Path.cwd()) as server:
        click.echo(server.address)
        if not no_browser:
            from webbrowser import open_new_tab

            open_new_tab(server.address)
        try:
            server.serve_forever(poll_interval=0.5)
        except KeyboardInterrupt:
            click.echo("The page is served no longer.", err=True)


def _drawn_value(model: str | None) -> tuple[Any, Path | None]:
    """What is drawn on, as its author wrote it but for numbers that are set, and the file to which it is saved."""
    from planar.document.files import PIPED, find_model_file, load_value, model_files, parse_json, to_dict
    from planar.document.texts.mechanism_link import is_link, read_link
    from planar.pages.editor.answer import BLANK

    if model is None:
        refuse_settings()
        return BLANK, None
    path = None
    if model != PIPED and not is_link(model):
        file = find_model_file(model)
        path = None if file in set(model_files()) else file  # those that come along are saved under another name
    if click.get_current_context().meta.get(SETTINGS):
        return to_dict(read_model(model)), path
    value = parse_json(read_link(model), "link") if is_link(model) else load_value(path or _known(model), "a mechanism")
    if not isinstance(value, dict):
        raise BadInput(model, "a mechanism's file is a JSON object")
    return value, path


def _known(model: str) -> str | Path:
    """What is piped in, or the file of a model that comes along."""
    from planar.document.files import PIPED, find_model_file

    return model if model == PIPED else find_model_file(model)
