"""A plan for less than all that was said is read back, and comes after everybody else."""


def told(desk):
    return [(one["event"], one.get("question", "")) for one in desk.answers()]


def test_the_gist_is_read_back_and_done_after_a_yes(open_desk):
    desk = open_desk()
    desk.give(text="Quick as you like, somebody rings: go to the kitchen")
    ((event, question),) = told(desk)
    assert event == "asked"
    assert question.startswith("Shall I go to the kitchen?")
    assert desk.plans() == [], "nothing moves before the person agrees"
    desk.give(command_id="c2", text="yes")
    desk.answers()
    (plan,) = desk.plans()
    assert plan["plan"]["actions"][0]["parameters"]["place"] == "kitchen"


def test_whoever_understands_the_whole_goes_first(open_desk, rung, propose):
    model = rung("model", propose(("navigate_to", {"place": "bedroom"})))
    desk = open_desk(model)
    desk.give(text="Quick as you like, somebody rings: go to the kitchen")
    desk.answers()
    (plan,) = desk.plans()
    assert plan["plan"]["actions"][0]["parameters"]["place"] == "bedroom"


def test_a_spoken_gist_gives_way_to_another_reading_of_the_whole(open_desk):
    desk = open_desk()
    heard = {"confidence": 0.9, "others": [{"text": "go to the bedroom", "odds": 0.6}]}
    desk.give(text="dinner is wrung, go to the kitchen", source="voice", heard=heard)
    ((event, question),) = told(desk)
    assert event == "asked"
    assert question.startswith("Shall I go to the bedroom?")


def test_what_is_said_alone_moves_nothing(open_desk):
    desk = open_desk()
    desk.give(text="somebody rings, it is late")
    assert [event for event, _ in told(desk)] == ["rejected"]
    assert desk.plans() == []
