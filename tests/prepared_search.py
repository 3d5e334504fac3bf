"""A search whose answer is known beforehand, for tests of how a page asks for designs; it imports little."""

from copy import deepcopy
from multiprocessing.connection import Connection
from typing import Any

LENGTHS = (61.0, 62.0, 63.0, 64.0, 65.0, 66.0)
"""mm: of the link BC in the designs."""


def send_designs(line: Connection, value: dict[str, Any]) -> None:
    """Send the start of a task with other lengths as designs. It replaces `search_for` in the process of a search."""
    designs = []
    for number, length in enumerate(LENGTHS, start=1):
        document = deepcopy(value["start"])
        document["links"]["BC"]["length"] = length
        words = f"misses by {number} mm (root mean square), by {2 * number} mm at most"
        designs.append({"words": words, "document": document})
    line.send({"progress": "", "is_over": True, "designs": designs, "remarks": ["the first remark", "the second one"]})
