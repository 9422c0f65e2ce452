"""Text that comes from files: decoded, bounded, and safe to show on a terminal."""

from __future__ import annotations

__all__ = ["printable"]


def printable(value: object, limit: int) -> str:
    r"""Return text without the characters that could steer a terminal.

    Bytes are decoded as UTF-8 with replacement; line feeds and tabs stay.

    Examples
    --------
    >>> printable(b"rod\x1b[2J\xff", 100)
    'rod[2J\ufffd'
    """
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return "".join(c for c in text[:limit] if c.isprintable() or c in "\n\t")
