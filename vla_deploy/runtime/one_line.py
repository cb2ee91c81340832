"""Fold what others say over several lines into one, for a log or a message."""


def one_line(said: object) -> str:
    """Return a text, or an error's, with every run of white space as one space."""
    return " ".join(str(said).split())
