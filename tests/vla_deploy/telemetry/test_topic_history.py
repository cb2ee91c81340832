from vla_deploy.telemetry.channels import TopicValue
from vla_deploy.telemetry.topic_history import BoundedValues


def kept(stamp_ns, size=1):
    return TopicValue(stamp_ns=stamp_ns, sequence=stamp_ns, payload=bytes(size))


def test_values_come_back_by_time_over_all_channels():
    history = BoundedValues(kept_ns=100, limit_bytes=100)
    for channel, stamp in (("a", 1), ("a", 5), ("b", 3)):
        history.add(channel, kept(stamp))
    assert [(name, one.stamp_ns) for name, one in history.snapshot()] == [
        ("a", 1),
        ("b", 3),
        ("a", 5),
    ]


def test_old_values_go_but_the_newest_of_each_channel_stays():
    history = BoundedValues(kept_ns=10, limit_bytes=100)
    for stamp in (1, 5, 20):
        history.add("busy", kept(stamp))
    history.add("quiet", kept(2))
    history.drop_old(25)
    assert [(name, one.stamp_ns) for name, one in history.snapshot()] == [
        ("quiet", 2),
        ("busy", 20),
    ]


def test_bytes_are_bounded_and_the_largest_channel_gives_way():
    history = BoundedValues(kept_ns=10**9, limit_bytes=1000)
    history.add("small", kept(0, 100))
    for stamp in range(1000):
        history.add("large", kept(stamp, 90))
        assert history.size_bytes <= 1000
    assert history.newest("small") == kept(0, 100)
    assert history.dropped == 990
