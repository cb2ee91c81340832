"""Turn a recording or a flight into entities of Rerun's."""

from vla_deploy.telemetry.recording.selection import Selection
from vla_deploy.telemetry.replay.source import Recorded, Source
from vla_deploy.telemetry.rerun.filling import Filling
from vla_deploy.telemetry.rerun.showing import ODD, Showing


def convert(source: Source, showing: Showing, selection: Selection) -> int:
    """Show what a file holds and return how many messages it was; its views are drawn if missing.

    Values that are older than the file are shown from its beginning on.

    Raises:
        FlightUnreadable: the file is spoiled.
    """
    filling = Filling(source.summary)
    for channel, text in filling.still(source.began_ns):
        if selection.takes(channel):
            showing.add(channel, source.began_ns, text)
    messages = 0
    for message in source.from_moment(0):
        messages += 1
        stamp_ns = max(message.stamp_ns + source.summary.wall_offset_ns, source.began_ns)
        if selection.takes(message.channel):
            showing.add(message.channel, stamp_ns, message.text)
        _add_views(message, stamp_ns, filling, showing, selection)
    return messages


def _add_views(
    message: Recorded, stamp_ns: int, filling: Filling, showing: Showing, selection: Selection
) -> None:
    try:
        for channel, text in filling.of(message.channel, message.text, stamp_ns):
            if selection.takes(channel):
                showing.add(channel, stamp_ns, text)
    except ODD as error:
        showing.leave_out(f"views of {message.channel}", error)
