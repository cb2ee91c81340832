from vla_deploy.planning.catalogue import SKILLS
from vla_deploy.planning.symbolic.table import LOGIC


def test_every_skill_of_the_catalogue_has_its_logic() -> None:
    assert set(LOGIC) == set(SKILLS)


def test_every_skill_says_what_it_leaves() -> None:
    assert all(logic.leaves for logic in LOGIC.values())
