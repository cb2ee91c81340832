"""Say by which of the robot's own words it knows what other networks call a thing.

Only other words for the same kind are listed: a wine glass is no cup here, since a name that
nearly fits would support a wrong one. What is in no list keeps its own name.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from vla_deploy.perception.naming.classes import FURNITURE

_WORDS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "cup": ("mug", "coffee cup", "coffee mug", "teacup", "drinking cup"),
        "ball": ("sports ball", "tennis ball", "toy ball"),
        "book": ("books", "notebook"),
        "bottle": ("water bottle", "wine bottle", "plastic bottle", "beer bottle"),
        "phone": ("cell phone", "cellphone", "mobile phone", "smartphone", "smart phone"),
        "keys": ("key", "key ring", "bunch of keys"),
        "box": ("cardboard box", "carton", "storage box"),
        "can": ("tin can", "beverage can", "soda can", "drink can"),
        "remote": ("remote control", "tv remote"),
        "person": ("man", "woman", "boy", "girl", "child", "human", "pedestrian"),
        "chair": ("armchair", "stool", "office chair"),
        FURNITURE: (
            "dining table", "coffee table", "kitchen table", "table", "desk", "couch", "sofa",
            "sofa bed", "bed", "bench", "cabinet", "cupboard", "wardrobe", "closet", "shelf",
            "bookcase", "nightstand", "chest of drawers", "refrigerator", "fridge", "oven",
            "dishwasher", "washing machine", "sink", "toilet", "bathtub",
        ),
    }
)  # fmt: skip
OTHER_WORDS: Final[Mapping[str, str]] = MappingProxyType(
    {word: name for name, words in _WORDS.items() for word in (name, *words)}
)
"""COCO's, Open Images' and Objects365's names of what the robot knows, in small letters."""


def known_as(class_name: str) -> str:
    """Return the robot's word for a network's class: the class itself where it has no other."""
    words = class_name.lower().replace("_", " ").replace("-", " ")
    return OTHER_WORDS.get(" ".join(words.split()), class_name)
