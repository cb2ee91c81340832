from vla_deploy.dashboard.alarms.alarm import AlarmFinding, AlarmSeverity
from vla_deploy.dashboard.alarms.manager import RAISE_DELAYS, judge

S = 1_000_000_000
HOT = AlarmFinding(
    process="control", field="heat", text="hot", severity=AlarmSeverity.WARNING, advice="cool it"
)
RISE_S, FALL_S = (
    RAISE_DELAYS[AlarmSeverity.WARNING].rise_s,
    RAISE_DELAYS[AlarmSeverity.WARNING].fall_s,
)


def play(*looks):
    """Judge (time in s, findings) after each other; return what is raised after each look."""
    conditions, raised = {}, []
    for at_s, findings in looks:
        conditions = judge(conditions, {one.key: one for one in findings}, round(at_s * S))
        raised.append([one.finding for one in conditions.values() if one.raised])
    return raised


def test_a_condition_becomes_an_alarm_once_it_has_lasted():
    assert play((0, [HOT]), (RISE_S - 0.1, [HOT]), (RISE_S, [HOT])) == [[], [], [HOT]]


def test_one_that_goes_before_its_time_is_none_and_begins_anew():
    assert play((0, [HOT]), (1, []), (RISE_S, [HOT]), (RISE_S + 1, [HOT])) == [[]] * 4


def test_an_alarm_ends_only_when_its_condition_has_been_gone_for_a_while():
    over_s = RISE_S + FALL_S
    looks = play((0, [HOT]), (RISE_S, [HOT]), (over_s - 0.1, []), (over_s, []))
    assert looks == [[], [HOT], [HOT], []]


def test_a_condition_that_comes_and_goes_is_one_alarm():
    looks = [(at_s, [HOT] if at_s % 2 else []) for at_s in range(int(RISE_S) + 1, 20)]
    raised = play((0, [HOT]), (RISE_S, [HOT]), *looks)
    assert raised[1:] == [[HOT]] * (len(looks) + 1)


def test_what_a_rule_says_of_its_patience_goes_before_the_table():
    at_once = AlarmFinding(**{name: getattr(HOT, name) for name in HOT.__slots__} | {"rise_s": 0.0})
    assert play((0, [at_once])) == [[at_once]]


def test_an_alarm_shows_the_newest_numbers():
    hotter = AlarmFinding(
        **{name: getattr(HOT, name) for name in HOT.__slots__} | {"measured": 80.0}
    )
    assert play((0, [HOT]), (RISE_S, [hotter]))[1][0].measured == 80.0


def test_the_graver_the_sooner():
    rises = [RAISE_DELAYS[severity].rise_s for severity in AlarmSeverity]
    assert rises == sorted(rises)
    assert set(RAISE_DELAYS) == set(AlarmSeverity)
