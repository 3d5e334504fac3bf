"""The guide's topics, in the order in which its first page lists them."""

from __future__ import annotations

import re
from functools import cache
from typing import NamedTuple

from planar.document.files import read_packaged_text
from planar.foundation.errors import BadInput, suggest_name

FIRST_PAGE = "index"
LIST_ENTRY = re.compile(r"^- \[(?P<title>[^\]]+)\]\((?P<path>[\w/-]+)\.md\)(?:: (?P<summary>.*))?$", re.MULTILINE)
PAGE_LINK = re.compile(r"(?<!!)\[(?P<title>[^\]]+)\]\((?:[\w./-]*/)?(?P<name>[\w-]+)\.md\)")
PICTURE = re.compile(r"^!\[(?P<title>[^\]]+)\]\([^)]+\)\n", re.MULTILINE)


class Topic(NamedTuple):
    """A page: its path below the guide, its title, and what it is about in a few words or nothing."""

    path: str
    title: str
    summary: str

    @property
    def name(self) -> str:
        """As after `planar guide`."""
        return self.path.rpartition("/")[2]

    def text(self) -> str:
        """The page, in Markdown."""
        return read_page(self.path)


def read_page(path: str) -> str:
    """The Markdown of a page by its path below the guide."""
    return read_packaged_text("guide", f"{path}.md")


def terminal_text(page: str) -> str:
    """A page as a terminal shows it: other pages by their command, no pictures, no marks of files."""
    text = PAGE_LINK.sub(r"\g<title> (`planar guide \g<name>`)", page)
    return PICTURE.sub("", re.sub(r"<!--.*?-->\n", "", text))


@cache
def guide_topics() -> tuple[Topic, ...]:
    """All topics but the first page, which lists them."""
    entries = LIST_ENTRY.finditer(read_page(FIRST_PAGE))
    return tuple(Topic(each["path"], each["title"], each["summary"] or "") for each in entries)


def find_topic(name: str) -> Topic:
    """The topic of a name or a title. Raises BadInput."""
    known = {each.name: each for each in guide_topics()}
    titles = {each.title.lower(): each for each in guide_topics()}
    wanted = name.strip().lower()
    found = known.get(wanted) or titles.get(wanted)
    if found is None:
        meant = suggest_name(wanted, known, "topics", None)
        raise BadInput("TOPIC", f"the guide has no page {name!r:.60}{meant}")
    return found
