"""A whole mechanism file in one word, to be passed on: `planar:` and the file, deflated (RFC 1951), in base64url."""

from __future__ import annotations

import json
import zlib
from base64 import urlsafe_b64decode, urlsafe_b64encode
from typing import Any

from planar.document import LINK_PREFIX
from planar.foundation.errors import BadInput

MAX_LINK_BYTES = 8 * 1024 * 1024
"""Bytes of the file that a link holds."""


def is_link(text: str) -> bool:
    """Whether a text is such a word, and no file's name."""
    return text.startswith(LINK_PREFIX)


def write_link(value: Any) -> str:
    """The link of a file's JSON value.

    >>> read_link(write_link({"planar": 1}))
    '{"planar":1}'
    """
    packer = zlib.compressobj(9, wbits=-zlib.MAX_WBITS)
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":")).encode()
    return LINK_PREFIX + urlsafe_b64encode(packer.compress(text) + packer.flush()).decode().rstrip("=")


def read_link(link: str) -> str:
    """The JSON text that a link holds. Raises BadInput where it is cut short or none."""
    told = f"{link[:30]}…" if len(link) > 31 else link
    packed = link.removeprefix(LINK_PREFIX).strip()
    try:
        unpacker = zlib.decompressobj(wbits=-zlib.MAX_WBITS)
        content = unpacker.decompress(urlsafe_b64decode(packed + "=" * (-len(packed) % 4)), MAX_LINK_BYTES)
        if unpacker.unconsumed_tail or not unpacker.eof:
            raise ValueError
        return content.decode()
    except (ValueError, zlib.error):
        raise BadInput(told, "this link holds no whole mechanism; copy all of it") from None
