import pytest
import yaml

from vla_deploy.gateways.ros.errors import ParametersUnusable
from vla_deploy.gateways.ros.parameters import (
    API_KEY_VARIABLE,
    PARAMETERS,
    PARAMS_FILE_VARIABLE,
    SECTIONS,
    handed_over_parameters,
)


@pytest.fixture
def handed_over(tmp_path):
    """Hand a document over as a launch does; return what the gateway reads."""

    def hand_over(document, **variables):
        file = tmp_path / "parameters.yaml"
        file.write_text(document if isinstance(document, str) else yaml.safe_dump(document))
        return handed_over_parameters({PARAMS_FILE_VARIABLE: str(file), **variables})

    return hand_over


def test_nothing_handed_over_is_no_parameter() -> None:
    assert handed_over_parameters({}) == {}


@pytest.mark.parametrize("section", SECTIONS)
def test_each_name_of_the_node_is_understood(handed_over, section) -> None:
    document = {section: {"ros__parameters": {"max_speed": 0.3}}, "other": {"ros__parameters": {}}}
    assert handed_over(document) == {"max_speed": 0.3}


def test_what_names_the_node_goes_before_what_is_for_all(handed_over) -> None:
    rows = {"/**": {"max_speed": 0.3, "use_sim_time": True}, "vla_deploy": {"max_speed": 0.2}}
    document = {name: {"ros__parameters": row} for name, row in rows.items()}
    assert handed_over(document) == {"max_speed": 0.2, "use_sim_time": True}


def test_a_whole_number_where_a_number_is_meant_becomes_one(handed_over) -> None:
    value = handed_over("/**: {ros__parameters: {plan_timeout: 30}}")["plan_timeout"]
    assert (value, type(value)) == (30.0, float)


def test_the_key_comes_by_itself_and_goes_before_the_files(handed_over) -> None:
    document = "/**: {ros__parameters: {vlm_api_key: of the file}}"
    assert handed_over(document, **{API_KEY_VARIABLE: "given"}) == {"vlm_api_key": "given"}
    assert handed_over_parameters({API_KEY_VARIABLE: "given"}) == {"vlm_api_key": "given"}


def test_all_faults_are_told_at_once(handed_over) -> None:
    wrong = {
        "vlm_provider": "telepathy",
        "max_replan_attempts": 2.5,
        "plan_timeout": "long",
        "require_confirmation": 1,
        "max_speed": -1.0,
        "restricted_areas": ["stairs", 3],
    }
    with pytest.raises(ParametersUnusable) as told:
        handed_over({"/**": {"ros__parameters": wrong}})
    for name in wrong:
        assert f"{name}: expected" in str(told.value)
    assert "one of anthropic, openai, local, got 'telepathy'" in str(told.value)
    assert "max_speed: expected a number in 0.01..5, got -1.0" in str(told.value)


@pytest.mark.parametrize(
    "document", ["", "[]", "planner: {ros__parameters: {}}", "/**: {max_speed: 1.0}", "{"]
)
def test_a_file_without_parameters_of_the_node_is_refused(handed_over, document) -> None:
    with pytest.raises(ParametersUnusable, match=r"parameters\.yaml"):
        handed_over(document)


@pytest.mark.parametrize(
    "document", ["/**: {ros__parameters: {vlm_api_key: 5551234}}", "/**: {vlm_api_key: '5551234"]
)
def test_no_fault_shows_a_key(handed_over, document) -> None:
    with pytest.raises(ParametersUnusable) as told:
        handed_over(document)
    assert "5551234" not in str(told.value)


def test_a_file_that_is_not_there_is_refused() -> None:
    with pytest.raises(ParametersUnusable, match="/absent"):
        handed_over_parameters({PARAMS_FILE_VARIABLE: "/absent"})


def test_every_default_is_allowed() -> None:
    assert [one.name for one in PARAMETERS if not one.allows(one.default)] == []
