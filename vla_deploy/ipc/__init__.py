"""Share state, events and images between the robot's processes."""

from vla_deploy.ipc.announcer import Announced, Announcer
from vla_deploy.ipc.claim_book import ClaimBook
from vla_deploy.ipc.claims import Book, Claim
from vla_deploy.ipc.errors import (
    BadPayload,
    ClaimRefused,
    IpcError,
    ReplayOnly,
    SchemaMismatch,
    SpaceUnavailable,
    UnknownTopic,
)
from vla_deploy.ipc.memory.cell import CellReader, CellWriter, Sample
from vla_deploy.ipc.memory.doorbell import Doorbell
from vla_deploy.ipc.memory.frame_ring import Frame, FrameReader, FrameWriter
from vla_deploy.ipc.memory.record_ring import Record, RecordReader, RecordWriter
from vla_deploy.ipc.memory.ring import Event, RingReader, RingWriter
from vla_deploy.ipc.pulse import Pulse, PulseReader
from vla_deploy.ipc.space import SharedSpace
from vla_deploy.ipc.stop_button import StopButton
from vla_deploy.ipc.topics import BY_NAME, TOPICS, PackedField, Topic, TopicKind

__all__ = [
    "BY_NAME",
    "TOPICS",
    "Announced",
    "Announcer",
    "BadPayload",
    "Book",
    "CellReader",
    "CellWriter",
    "Claim",
    "ClaimBook",
    "ClaimRefused",
    "Doorbell",
    "Event",
    "Frame",
    "FrameReader",
    "FrameWriter",
    "IpcError",
    "PackedField",
    "Pulse",
    "PulseReader",
    "Record",
    "RecordReader",
    "RecordWriter",
    "ReplayOnly",
    "RingReader",
    "RingWriter",
    "Sample",
    "SchemaMismatch",
    "SharedSpace",
    "SpaceUnavailable",
    "StopButton",
    "Topic",
    "TopicKind",
    "UnknownTopic",
]
