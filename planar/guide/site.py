"""The guide as a site: its pages and a reference of all public names, with a search that works from a folder."""

from __future__ import annotations

import io
import shutil
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from warnings import catch_warnings, simplefilter

import planar
from planar.foundation.errors import BadInput, WriteFailure
from planar.foundation.safe_files import save_file
from planar.guide.reference import reference_pages
from planar.guide.topics import FIRST_PAGE, guide_topics, read_page

GUIDE_FOLDER = Path(__file__).parent
SETTINGS: dict[str, Any] = {
    "project": "planar",
    "author": "",
    "copyright": "",
    "release": planar.__version__,
    "extensions": ["myst_parser", "sphinx.ext.autodoc"],
    "html_theme": "furo",
    "html_title": f"planar {planar.__version__}",
    "html_show_copyright": False,
    "html_show_sphinx": False,
    "html_copy_source": False,
    "html_show_search_summary": False,  # it would be fetched, which a page opened from a folder may not
    "html_static_path": ["_static"],
    "html_css_files": ["guide.css"],
    "default_role": "py:obj",
    "myst_heading_anchors": 3,
    "autodoc_typehints": "signature",
    "autodoc_member_order": "bysource",
    "autodoc_preserve_defaults": True,
    "suppress_warnings": ["misc.highlighting_failure"],
}
"""What Sphinx is told."""
STYLE = "article img { max-height: 34rem; width: auto; }\n"
"""No picture is taller than a screen."""


def write_site(folder: Path) -> Path:
    """Write the site into a folder, which is made; its first page. Raises BadInput where Sphinx is not installed."""
    try:
        application: Any = import_module("sphinx.application").Sphinx
        import_module("myst_parser")
        import_module("furo")
    except ImportError:
        raise BadInput("--html", 'the site is made with Sphinx: pip install "planar-linkages[guide]"') from None
    with TemporaryDirectory() as place:
        source, made = Path(place, "source"), Path(place, "site")
        _write_sources(source)
        with catch_warnings():
            simplefilter("ignore")  # what its parts say of each other
            told = {"confoverrides": SETTINGS, "status": None, "warning": io.StringIO()}
            builder = application(source, None, made, Path(place, "trees"), "html", **told)
            builder.connect("autodoc-skip-member", _skip_unexplained)
            builder.build()
        shutil.rmtree(made / ".doctrees", ignore_errors=True)
        try:
            shutil.copytree(made, folder, dirs_exist_ok=True)
        except OSError as problem:
            raise WriteFailure(str(folder), f"the site cannot be written: {problem.strerror}") from None
    return folder / f"{FIRST_PAGE}.html"


def _skip_unexplained(_: Any, __: str, ___: str, value: Any, skips: bool, ____: Any) -> bool | None:
    """Leave out a named tuple's fields, which its own docstring explains."""
    return True if skips or str(getattr(value, "__doc__", "")).startswith("Alias for field") else None


def _write_sources(source: Path) -> None:
    """The pages as Sphinx reads them: those of the guide, and the reference."""
    paths = [each.path for each in guide_topics()]
    contents = "\n".join(["```{toctree}", ":hidden:", "", *paths, "reference", "```"])
    pages = {f"{path}.md": read_page(path) for path in paths}
    pages[f"{FIRST_PAGE}.md"] = f"{read_page(FIRST_PAGE)}\n{contents}\n"
    pages |= {f"{name}.rst": text for name, text in reference_pages().items()}
    for path, text in pages.items():
        (source / path).parent.mkdir(parents=True, exist_ok=True)
        save_file(source / path, text)
    (source / "_static").mkdir()
    save_file(source / "_static" / "guide.css", STYLE)
    shutil.copytree(GUIDE_FOLDER / "pictures", source / "pictures")
