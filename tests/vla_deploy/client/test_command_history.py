"""Commands of every source are remembered with what became of them, by a clock moved by hand."""

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.client.command_history import MOST_COMMANDS, CommandHistory
from vla_deploy.client.command_record import MOST_EVENTS
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import SharedSpace

PLAN = {"actions": [{"id": "a1", "skill": "wave", "parameters": {}}]}
ACTION = {
    "action_id": "a1",
    "skill": "wave",
    "parameters": {},
    "status": "active",
    "execution_time_s": 0.0,
    "error": None,
    "retries": 0,
    "note": None,
}


class HandClock:
    def __init__(self):
        self.time_ns = 1000 * NS_PER_S

    def now_ns(self):
        return self.time_ns

    def sleep_until(self, deadline_ns):
        self.time_ns = max(self.time_ns, deadline_ns)

    def pass_s(self, seconds):
        self.time_ns += round(seconds * NS_PER_S)

    def wall_ns(self):
        return self.time_ns + 1_800_000_000 * NS_PER_S


class Robot:
    def __init__(self, run_dir, clock):
        self.clock = clock
        self.link = RobotLink(run_dir, clock)
        self.space = SharedSpace(run_dir / "ipc", clock)
        self.history = CommandHistory(self.link, clock.wall_ns)
        self._ring = self.space.ring_writer("task_event")

    def tell(self, command_id, event, **details):
        self._ring.publish({"command_id": command_id, "event": event} | details)

    def plans(self, *command_ids):
        self.space.cell_writer("planner_status").put_document({"commands": list(command_ids)})

    def state(self, command_id):
        return self.history.find(command_id).document()["state"]


@pytest.fixture
def robot(tmp_path):
    world = Robot(tmp_path / "run", HandClock())
    yield world
    world.history.stop()
    world.space.close()
    world.link.close()


@pytest.mark.parametrize(
    ("event", "details", "state"),
    [
        ("queued", {"place": 1}, "queued"),
        ("planning", {"rungs": ["rules"]}, "planning"),
        ("asked", {"question": "which?"}, "asked"),
        ("accepted", {}, "active"),
        ("rejected", {"reason": "no cup is known"}, "rejected"),
        ("rejected", {"reason": "cancelled on request"}, "cancelled"),
        ("finished", {"success": True, "error": None}, "succeeded"),
        ("finished", {"success": False, "error": "the cup fell"}, "failed"),
        ("finished", {"success": False, "error": "cancelled on request"}, "cancelled"),
        ("finished", {"success": False, "error": "lost: the executor ended"}, "lost"),
    ],
)
def test_an_event_says_how_a_command_stands(robot, event, details, state):
    command_id = robot.link.utter(text="wave")
    assert robot.state(command_id) == "given"
    robot.tell(command_id, event, **details)
    assert robot.state(command_id) == state


def test_commands_of_other_sources_are_remembered_too_with_their_wall_time(robot):
    robot.link.writer("utterance").publish({"command_id": "v1", "source": "voice", "text": "wave"})
    robot.clock.pass_s(1.0)
    robot.tell("v1", "accepted")
    robot.clock.pass_s(1.0)
    (record,) = robot.history.newest(10)
    told = record.document()
    assert (told["source"], told["text"], told["kind"]) == ("voice", "wave", "command")
    assert told["events"][0]["at_s"] == pytest.approx(told["given_s"] + 1.0)
    assert robot.clock.wall_ns() / 1e9 == pytest.approx(told["given_s"] + 2.0)


def test_a_later_dashboard_finds_what_is_still_in_the_rings(robot):
    command_id = robot.link.utter(text="wave")
    robot.tell(command_id, "finished", success=True, error=None, actions=[])
    later = CommandHistory(robot.link, robot.clock.wall_ns)
    assert later.find(command_id).document()["state"] == "succeeded"
    later.stop()


def test_a_command_that_nobody_answers_is_told_as_lost(robot):
    command_id = robot.link.utter(text="wave")
    robot.history.step()
    robot.clock.pass_s(5.5)
    assert robot.state(command_id) == "lost"
    last = robot.history.find(command_id).document()["events"][-1]
    assert "no answer from planner or executor within 5 s" in last["error"]


def test_a_command_that_its_executor_forgot_is_lost_with_its_actions(robot):
    command_id = robot.link.utter(text="wave")
    robot.tell(command_id, "plan", plan=PLAN)
    robot.tell(command_id, "action", **ACTION)
    for _ in range(13):
        robot.clock.pass_s(0.5)
        robot.history.step()
    last = robot.history.find(command_id).document()["events"][-1]
    assert last["error"].startswith("lost: the executor has not spoken of the command for 5 s")
    assert [one["status"] for one in last["actions"]] == ["lost"]


def test_a_command_that_the_planner_names_is_not_lost(robot):
    command_id = robot.link.utter(text="tidy up")
    robot.tell(command_id, "planning", rungs=["server"])
    for _ in range(30):
        robot.plans(command_id)
        robot.clock.pass_s(0.5)
        robot.history.step()
    assert robot.state(command_id) == "planning"


def test_an_answer_ends_where_the_command_that_asked_goes_on(robot):
    asked = robot.link.utter(text="take it")
    robot.tell(asked, "asked", question="which?")
    answer = robot.link.utter(text="the red one", answer=True)
    robot.tell(answer, "answered", of=asked)
    robot.tell(asked, "accepted")
    assert (robot.state(answer), robot.state(asked)) == ("answered", "active")


def test_events_that_were_overwritten_unread_are_counted_at_the_commands_in_work(robot):
    done = robot.link.utter(text="one")
    robot.tell(done, "finished", success=True, error=None)
    command_id = robot.link.utter(text="two")
    robot.history.step()
    for _ in range(300):  # the ring holds 256
        robot.tell(command_id, "said", text="la")
    robot.plans(command_id)
    assert robot.history.find(command_id).document()["lost_events"] == 300 - 256
    assert robot.history.find(done).document()["lost_events"] == 0


def test_what_is_remembered_is_bounded(robot):
    ids = [robot.link.utter(text=str(number)) for number in range(20)]
    for _ in range(MOST_COMMANDS // 20):
        robot.history.step()
        ids += [robot.link.utter(text="more") for _ in range(20)]
    assert robot.history.find(ids[0]) is None
    assert len(robot.history.newest(10_000)) == MOST_COMMANDS
    for _ in range(3):
        for _ in range(200):
            robot.tell(ids[-1], "said", text="la")
        robot.history.step()
    record = robot.history.find(ids[-1]).document()
    assert (len(record["events"]), record["lost_events"]) == (MOST_EVENTS, 600 - MOST_EVENTS)


def test_a_follower_gets_each_new_event_with_its_command_and_none_of_before(robot):
    before = robot.link.utter(text="wave")
    robot.tell(before, "accepted")
    followed = []
    history = CommandHistory(
        robot.link,
        robot.clock.wall_ns,
        follow=lambda record, event: followed.append((record.text, event["event"])),
    )
    robot.tell(before, "finished", success=True, error=None, actions=[])
    robot.link.utter(text="nod")
    history.step()
    robot.clock.pass_s(5.5)
    history.step()
    assert followed == [("wave", "finished"), ("nod", "finished")]
    assert history.find(before).given_s == pytest.approx(robot.clock.wall_ns() / 1e9 - 5.5)
    history.stop()


def test_the_parts_of_a_mission_have_its_source_and_their_own_words(robot):
    mission = robot.link.utter(mission={"goal": "tidy up", "objectives": ["take it", "go"]})
    part = f"{mission}/o1.s1+2"
    robot.tell(mission, "accepted")
    robot.tell(mission, "objective", part="o1", words="take it", state="executing")
    robot.tell(part, "plan", plan=PLAN)
    assert robot.state(mission) == "active"
    told = robot.history.find(part).document()
    assert (told["mission"], told["text"], told["state"]) == (mission, "take it", "active")
    assert told["source"] == robot.history.find(mission).document()["source"]
    assert robot.history.find(mission).document()["text"] == "tidy up"


def test_a_mission_that_begins_again_is_followed_again_and_ends_once_each_time(robot):
    mission = robot.link.utter(text="every hour, go")
    done = {"success": True, "error": None, "actions": []}
    robot.tell(mission, "finished", **done)
    robot.tell(mission, "finished", **done)  # not heard twice
    assert len(robot.history.find(mission).events) == 1
    robot.tell(mission, "objective", part="o1", words="go", state="executing")
    assert robot.state(mission) == "active"
    for _ in range(13):
        robot.clock.pass_s(0.5)
        robot.history.step()
    assert robot.state(mission) == "lost"  # the planner is away
