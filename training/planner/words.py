"""List the words that sentences are filled with: things, colours, places, people, sayings."""

from random import Random
from typing import Final

from vla_deploy.world.vocabulary import COLOURS, OBJECT_CLASSES, SYNONYMS

KNOWN_THINGS: Final = (
    *(one for one in OBJECT_CLASSES if one != "object"),
    *(word for word, kind in SYNONYMS.items() if kind in OBJECT_CLASSES and kind != "object"),
    "coffee mug", "coffee cup", "tea cup", "water bottle", "tv remote", "remote control",
    "car keys",
    "house keys", "cell phone", "mobile phone", "soda can", "tin can", "coke can", "tennis ball",
    "cardboard box", "storage box", "fruit bowl", "salad bowl", "cereal bowl", "beer bottle",
    "soda",
    "wine bottle", "beer can", "rubber ball", "toy ball", "toy box", "drinking glass", "cookbook",
    "school book", "iphone", "bunch of keys", "set of keys", "front door key", "soccer ball", "tin",
    "plastic bottle", "glass bottle", "paper cup", "set", "jar", "football", "handset", "cola can",
)  # fmt: skip
OTHER_THINGS: Final = (
    "spoon", "fork", "knife", "plate", "banana", "apple", "newspaper", "pen", "pencil", "wallet",
    "purse", "bag", "backpack", "shoe", "shoes", "jacket", "coat", "hat", "umbrella", "towel",
    "pan",
    "pot", "kettle", "vase", "lamp", "candle", "clock", "watch", "ring", "glasses", "sunglasses",
    "charger", "cable", "laptop", "tablet", "camera", "headphones", "battery", "toy", "doll",
    "teddy",
    "teddy bear", "lego brick", "car", "puzzle", "pillow", "blanket", "sock", "socks", "shirt",
    "tie",
    "scissors", "tape", "stapler", "hammer", "screwdriver", "wrench", "nail", "screw", "brush",
    "comb", "toothbrush", "soap", "shampoo", "sponge", "tissue", "tissues", "napkin", "paper",
    "letter", "envelope", "magazine", "folder", "notepad", "marker", "ruler", "calculator", "mouse",
    "keyboard", "medicine", "pills", "snack", "chips", "cookies", "bread", "milk", "juice",
    "orange",
    "lemon", "sandwich", "cake", "cheese", "egg", "eggs", "salt", "pepper", "sugar", "cereal",
    "tea",
    "coffee", "water", "beer", "coke", "plant", "flower", "flowers", "picture", "dish", "lid",
    "cutlery", "tray", "saucer", "straw", "coin", "money", "card", "ticket", "passport", "cube",
    "block", "brick", "cylinder", "dice", "tool", "package", "parcel", "present", "gift",
    "hairbrush",
    "flashlight", "lighter", "whistle", "bell", "drone", "controller", "joystick", "sweater",
    "scarf",
    "glove", "gloves", "belt", "mask", "bucket", "rag", "cloth", "duster", "jug", "thermos",
    "lunchbox", "chocolate", "candy", "muffin", "yogurt", "carrot", "tomato", "potato", "onion",
)  # fmt: skip
COLOUR_WORDS: Final = (*COLOURS, "gray", "violet", "turquoise", "beige", "golden", "silver", "cyan",
                       "dark blue", "light green", "light blue", "dark red",
                       "bright yellow")  # fmt: skip
SIZE_WORDS: Final = (
    "small", "little", "big", "large", "tall", "flat", "long", "tiny", "huge", "short", "smaller",
    "bigger", "larger", "taller", "biggest", "smallest", "largest", "tallest", "medium", "longer",
)  # fmt: skip
ORDER_WORDS: Final = (
    "nearest", "closest", "farthest", "left", "right", "leftmost", "rightmost", "other", "second",
    "first", "last", "next", "furthest", "middle", "third", "same", "upper", "lower",
)  # fmt: skip
LOOK_WORDS: Final = (
    "old", "new", "empty", "full", "wooden", "plastic", "round", "heavy", "metal", "broken",
    "dirty",
    "clean", "striped", "shiny", "light", "soft", "favourite", "nice", "glass", "paper", "open",
)  # fmt: skip
PLACES: Final = (
    "kitchen", "living room", "bedroom", "bathroom", "hallway", "hall", "entrance", "front door",
    "door", "lounge", "sitting room", "dining room", "office", "study", "garage", "balcony",
    "garden",
    "basement", "attic", "laundry room", "guest room", "playroom", "nursery", "corridor", "pantry",
    "charging station", "charger", "dock", "charging dock", "home base", "cooking area",
    "sofa table",
    "sleeping room", "bed room", "night stand", "nightstand", "box table", "stand", "dinner table",
    "living room table", "workshop", "lab", "library", "lobby", "reception", "elevator", "desk",
    "meeting room", "conference room", "storage room", "closet", "terrace", "patio", "porch",
    "kitchen table", "coffee table", "side table", "bedside table", "dining table", "window",
    "sofa",
    "couch", "bed", "tv", "fridge", "sink", "stove", "counter", "kitchen counter", "shelf",
    "fireplace",
    "bookshelf", "armchair", "chair", "work desk", "cupboard", "wardrobe", "table", "front room",
    "corner", "room", "middle of the room", "center of the room", "back door", "staircase", "bin",
    "workbench", "washing machine", "kids room", "home office", "family room", "den", "foyer",
    "wall",
)  # fmt: skip
SURFACES: Final = (
    "table", "coffee table", "kitchen table", "side table", "bedside table", "dining table",
    "floor",
    "shelf", "desk", "counter", "sofa", "couch", "bed", "chair", "nightstand", "windowsill",
    "carpet",
    "kitchen counter", "ground", "tray", "stool", "bench", "box", "book", "mat", "stand", "dresser",
    "box table", "sofa table", "dinner table", "night stand", "living room table", "rug",
)  # fmt: skip
NAMES: Final = (
    "anna", "tom", "peter", "lisa", "john", "maria", "sarah", "max", "emma", "paul", "julia", "ben",
    "grandma", "grandpa", "mom", "dad", "susan", "james", "kate", "david", "laura", "michael",
    "lucy",
)  # fmt: skip
PEOPLE: Final = (
    *NAMES, "my wife", "my husband", "my mother", "my father", "my son", "my daughter", "the kids",
    "the guests", "him", "her", "them", "the visitor", "my friend", "my brother", "the man",
    "the woman", "the child", "my boss", "the baby", "our guest", "everyone", "the lady",
)  # fmt: skip
COUNTRIES: Final = ("france", "spain", "italy", "japan", "germany", "brazil", "canada", "india",
                    "london", "paris", "chicago", "berlin", "rome", "texas", "sweden",
                    "egypt")  # fmt: skip
FOODS: Final = ("pizza", "pasta", "sushi", "salad", "chicken", "rice", "soup", "cheese", "fish",
    "cake",
                "ice cream", "bread", "chocolate", "apples", "burgers", "tacos", "curry",
                "pancakes")  # fmt: skip
POSES: Final = ("tuck", "tucked", "rest", "resting", "home", "ready", "look ahead", "look down",
                "folded", "neutral", "carry", "carrying", "waving", "safe", "stow", "stowed",
                "default",
                "parking", "sleep", "forward", "up", "down", "zero", "driving",
                "travel")  # fmt: skip
SAYINGS: Final = (
    "hello", "hello world", "good morning", "good morning everyone", "dinner is ready",
    "happy birthday",
    "i am ready", "welcome home", "thank you very much", "the food is on the table", "lunch time",
    "i am a robot", "see you tomorrow", "please come to the kitchen", "it is time to go",
    "good night",
    "the meeting starts in ten minutes", "i love you", "the cup is in the box", "hi there",
    "excuse me",
    "please take a seat", "the door is open", "i found the keys", "how are you", "nice to meet you",
    "your phone is on the table", "stop the war", "i will be back", "mission complete",
    "be careful",
    "breakfast is served", "the train leaves at nine", "go to bed kids", "happy new year", "cheers",
    "congratulations", "my name is butler", "we have visitors", "the taxi is here",
    "goodbye friends",
    "pick up your toys", "the battery is low", "i am sorry", "can i help you", "what a lovely day",
    "turn left at the corner", "supper is ready", "coffee is ready", "someone is at the door",
    "yes sir",
    "test one two three", "ladies and gentlemen", "i am on my way", "the laundry is done",
    "well done",
    "i will be late", "you are late", "she is here", "bring your own drinks", "wait for me outside",
)  # fmt: skip
_ONSETS: Final = ("b", "br", "c", "ch", "d", "dr", "f", "fl", "g", "gr", "h", "j", "k", "l", "m",
    "n", "p",
                  "pl", "qu", "r", "s", "sh", "sk", "sl", "st", "t", "tr", "v", "w", "z", "th",
                  "")  # fmt: skip
_VOWELS: Final = ("a", "e", "i", "o", "u", "ee", "oo", "ai", "ou", "ea", "y")
_CODAS: Final = (
    "",
    "b",
    "ck",
    "d",
    "f",
    "g",
    "l",
    "m",
    "n",
    "nt",
    "p",
    "r",
    "rd",
    "s",
    "sh",
    "st",
    "t",
    "x",
)


def invented(random: Random) -> str:
    """Return a word that no list has, so that copying is learnt rather than words."""
    syllables = random.choice((1, 2, 2, 3))
    parts = [
        random.choice(_ONSETS) + random.choice(_VOWELS) + random.choice(_CODAS)
        for _ in range(syllables)
    ]
    return "".join(parts)
