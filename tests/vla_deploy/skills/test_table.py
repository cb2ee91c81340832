from vla_deploy.plans.catalogue import SKILLS
from vla_deploy.skills.table import SKILL_FUNCTIONS


def test_every_skill_of_the_catalogue_has_its_code_and_no_other() -> None:
    assert set(SKILL_FUNCTIONS) == set(SKILLS)
