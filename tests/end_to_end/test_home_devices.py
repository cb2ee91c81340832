"""A lamp of the flat is switched by words, shines in the twin, and is what it says itself."""

import pytest

from sim_twin.harness.lockstep_stack import LockstepStack
from sim_twin.home.appliances import ApplianceFault
from vla_deploy.devices import mqtt_link

pytestmark = pytest.mark.gl


def emission(stack: LockstepStack) -> float:
    model = stack.lockstep.twin.engine.model
    return float(model.mat_emission[model.mat("lit_lamp").id])


def test_a_lamp_is_switched_by_words_and_shines(
    coarse_stack: LockstepStack, monkeypatch: pytest.MonkeyPatch
) -> None:
    stack = coarse_stack
    dark = emission(stack)
    outcome = stack.say("turn on the lamp, then turn left 10 degrees")
    assert outcome["success"], outcome["error"]
    assert outcome["actions"][0]["note"] == "lamp is on, as read back"
    assert stack.lockstep.truth()["switched_on"] == ["lamp"]
    assert emission(stack) > dark
    lamp = stack.lockstep.twin.home.appliances["lamp"]
    lamp.press()
    assert stack.wait_until(
        lambda: stack.document("device_status")["devices"][0]["is_on"] is False, 10.0
    ), "what another hand does is seen"
    lamp.fault = ApplianceFault.FLIPS_BACK
    monkeypatch.setattr(mqtt_link, "STATE_S", 1.0)
    outcome = stack.say("switch the light on")
    assert not outcome["success"]
    assert outcome["error"].startswith("lamp: floor_lamp on the MQTT broker")
    assert "tells that it is off" in outcome["error"]
    assert emission(stack) == dark
