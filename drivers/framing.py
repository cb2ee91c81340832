"""Find frames in a stream of bytes by their header."""


def align(buffer: bytearray, header: bytes) -> tuple[bool, int]:
    """Drop bytes up to the next header; tell whether there is one, and how many were dropped.

    Without one, a last byte that may begin a two-byte header is kept.
    """
    at = buffer.find(header)
    found = at >= 0
    dropped = at if found else len(buffer) - buffer.endswith(header[:1])
    del buffer[:dropped]
    return found, dropped
