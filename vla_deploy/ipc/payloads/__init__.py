"""Type the JSON that rings and cells carry, beside the table of topics that names these types.

Times are monotonic nanoseconds of the run's clock, lengths and angles SI; `_m` and `_rad` are of
the map frame. A payload has the keys that its type has and no others; a reader that a broken writer
must not stop checks what it takes.
"""
