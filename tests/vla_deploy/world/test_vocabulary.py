from vla_deploy.manipulation.grasps import GRASP_RULES
from vla_deploy.perception.naming.classes import RULES
from vla_deploy.perception.naming.colour import NAMES
from vla_deploy.world.vocabulary import COLOURS, CONTAINERS, OBJECT_CLASSES, SYNONYMS


def test_there_is_a_word_for_all_that_perception_names_and_hands_take() -> None:
    assert {rule.name for rule in RULES} <= set(OBJECT_CLASSES)
    assert set(GRASP_RULES) <= set(OBJECT_CLASSES)
    assert set(NAMES) == set(COLOURS)
    assert set(OBJECT_CLASSES) >= CONTAINERS


def test_every_synonym_stands_for_a_word_that_is_known() -> None:
    assert set(SYNONYMS.values()) <= {*OBJECT_CLASSES, *COLOURS}
    assert not set(SYNONYMS) & {*OBJECT_CLASSES, *COLOURS}
