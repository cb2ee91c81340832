import json

import numpy as np
import pytest

from vla_deploy.ipc import BY_NAME, TOPICS
from vla_deploy.ipc.memory.layout import record_dtype
from vla_deploy.telemetry.channels import cell_text, channels_of


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_every_topic_but_a_private_one_has_channels_with_a_json_schema(topic):
    channels = channels_of(topic)
    assert bool(channels) is not topic.private
    for channel in channels:
        assert json.loads(channel.schema_text)["type"] == "object"


def test_a_cell_becomes_json_of_its_fields_and_what_is_no_number_null():
    topic = BY_NAME["imu"]
    record = np.zeros(1, record_dtype(topic))
    record["yaw_rad"] = np.nan
    record["acceleration_m_s2"] = [[1.0, np.inf, 3.0]]
    document = json.loads(cell_text(topic, record.tobytes()))
    (channel,) = channels_of(topic)
    assert document.keys() == channel.schema["properties"].keys()
    assert document["yaw_rad"] is None
    assert document["acceleration_m_s2"] == [1.0, None, 3.0]
