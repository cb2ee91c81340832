import pytest

pytest_plugins = ["pytester"]

CONFTEST = 'pytest_plugins = ["sim_twin.pytest_plugin"]'
TESTS = """
def test_a_robot_runs(lockstep):
    lockstep.run_for(0.01)
    assert lockstep.truth()["objects"]

def test_two_robots_have_run_directories_of_their_own(make_lockstep):
    first, second = make_lockstep(seed=1), make_lockstep(seed=2)
    assert first.context.run_dir != second.context.run_dir
"""


def test_the_fixtures_give_robots_in_lockstep(pytester: pytest.Pytester) -> None:
    pytester.makeconftest(CONFTEST)
    pytester.makepyfile(TESTS)
    pytester.runpytest_inprocess("-p", "no:cacheprovider").assert_outcomes(passed=2)
