"""Take sentences of other talk from CLINC150 (Larson et al. 2019, CC BY 3.0), as plain words.

What is near a command of ours, or near what this robot is asked and cannot do, is left out.
"""

import json
from pathlib import Path
from typing import Final

from vla_deploy.planning.command_parser.wording import plain_words

_LEFT_OUT: Final = frozenset({
    "find_phone", "yes", "no", "maybe", "cancel", "repeat", "what_can_i_ask_you", "smart_home",
    "order",
    "play_music", "next_song", "update_playlist", "change_volume", "make_call", "text", "timer",
    "alarm",
    "reminder", "reminder_update", "calendar_update", "shopping_list_update", "todo_list_update",
    "spelling",
    "book_flight", "book_hotel", "restaurant_reservation", "translate", "schedule_meeting",
    "pay_bill",
    "schedule_maintenance", "calculator", "change_speed", "whisper_mode", "reset_settings",
    "sync_device",
    "what_song", "uber", "share_location", "current_location",
})  # fmt: skip
_MOST_WORDS: Final = 24


def read_chatter(file: Path, splits: tuple[str, ...] = ("train", "oos_train")) -> tuple[str, ...]:
    """Return the sentences of `data_full.json`.

    Raises:
        OSError: the file cannot be read.
        KeyError: it lacks a split.
    """
    document = json.loads(file.read_text(encoding="utf-8"))
    sentences = [
        " ".join(plain_words(text))
        for split in splits
        for text, intent in document[split]
        if intent not in _LEFT_OUT
    ]
    return tuple(one for one in sentences if 0 < len(one.split()) <= _MOST_WORDS)
