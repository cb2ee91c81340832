from vla_deploy.telemetry.history import History, Kept


def kept(stamp_ns, size=1):
    return Kept(stamp_ns=stamp_ns, sequence=stamp_ns, payload=bytes(size))


def test_values_come_back_by_time_over_all_channels():
    history = History(kept_ns=100, limit_bytes=100)
    for channel, stamp in (("a", 1), ("a", 5), ("b", 3)):
        history.keep(channel, kept(stamp))
    assert [(name, one.stamp_ns) for name, one in history.snapshot()] == [
        ("a", 1),
        ("b", 3),
        ("a", 5),
    ]


def test_old_values_go_but_the_newest_of_each_channel_stays():
    history = History(kept_ns=10, limit_bytes=100)
    for stamp in (1, 5, 20):
        history.keep("busy", kept(stamp))
    history.keep("quiet", kept(2))
    history.forget_old(25)
    assert [(name, one.stamp_ns) for name, one in history.snapshot()] == [
        ("quiet", 2),
        ("busy", 20),
    ]


def test_bytes_are_bounded_and_the_largest_channel_gives_way():
    history = History(kept_ns=10**9, limit_bytes=1000)
    history.keep("small", kept(0, 100))
    for stamp in range(1000):
        history.keep("large", kept(stamp, 90))
        assert history.size_bytes <= 1000
    assert history.newest("small") == kept(0, 100)
    assert history.dropped == 990
