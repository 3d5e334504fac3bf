"""The command `guide`."""

from __future__ import annotations

from pathlib import Path

import click

from planar.cli.options import main, show_status


@main.command()
@click.argument("topic", required=False)
@click.option("--html", "as_site", is_flag=True, help="The whole as a site, with a reference of all Python names.")
@click.option(
    "-o",
    "output",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="The folder for the site; left out, a folder of its own, and it is opened in the browser.",
)
def guide(topic: str | None, as_site: bool, output: Path | None) -> None:
    """How to use it, page by page: TOPIC names one; left out, what there is."""
    if as_site:
        _write_site(output)
        return
    if output is not None:
        raise click.UsageError("-o names the folder of the site; ask for it with --html")
    from rich.console import Console
    from rich.markdown import Markdown

    from planar.guide.topics import FIRST_PAGE, find_topic, read_page, terminal_text

    text = find_topic(topic).text() if topic else read_page(FIRST_PAGE)
    Console().print(Markdown(terminal_text(text), hyperlinks=False))


def _write_site(output: Path | None) -> None:
    from tempfile import mkdtemp

    from planar.guide.site import write_site

    folder = output or Path(mkdtemp(prefix="planar-guide-"))
    with show_status("The guide"):
        first = write_site(folder)
    click.echo(str(first))
    if output is None:
        from webbrowser import open_new_tab  # only where one is opened

        open_new_tab(first.as_uri())
