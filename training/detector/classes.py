"""Name what the detector tells apart, in the order of the network's channels."""

SMALL = ("cup", "ball", "book", "bottle", "phone", "keys", "box", "bowl", "can", "remote")
LARGE = ("person", "chair")
CLASSES = SMALL + LARGE
CLUTTER = "clutter"
"""Things that must not be found."""
IGNORED = "ignored"
"""Things that may be found or not, such as the backs of books on a shelf."""
