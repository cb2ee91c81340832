from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.ipc.claims import (
    Book,
    Claim,
    amend,
    ask,
    declare,
    obstacles,
    release,
    settle,
    widen,
)
from vla_deploy.ipc.errors import ClaimRefused

BODY = Book(capacities={"base": 1, "head": 1, "left_arm": 1, "right_arm": 1, "ram_mb": 1000})


def claim(holder: str, priority: int = 0, expires_ns: int = 0, **wants: int) -> Claim:
    return Claim(holder=holder, wants=wants, priority=priority, expires_ns=expires_ns)


def filled(*claims: Claim) -> Book:
    book = BODY
    for one in claims:
        book = ask(book, one, 0)
    return book


def holders(book: Book) -> list[str]:
    return [one.holder for one in book.granted]


def test_what_is_free_is_granted_at_once():
    assert holders(filled(claim("a", base=1), claim("b", head=1, left_arm=1))) == ["a", "b"]


def test_what_is_held_is_waited_for_and_granted_when_it_is_released():
    book = filled(claim("a", base=1), claim("b", base=1))
    assert (book.holds("b"), book.waits("b")) == (False, True)
    assert release(book, ["a"], 0).holds("b")


def test_one_that_gets_only_a_part_gets_nothing_and_holds_up_nobody_for_the_rest():
    book = filled(claim("a", base=1), claim("b", base=1, head=1))
    assert book.used("head") == 0


def test_nobody_overtakes_one_that_waits_for_the_same_resource():
    book = filled(claim("a", base=1), claim("b", base=1, head=1), claim("c", head=1))
    assert book.waits("c")
    assert holders(release(book, ["a"], 0)) == ["b"]


def test_one_that_wants_something_else_does_not_wait():
    assert filled(claim("a", base=1), claim("b", base=1), claim("c", left_arm=1)).holds("c")


def test_a_counted_resource_is_shared_up_to_its_capacity():
    book = filled(claim("a", ram_mb=600), claim("b", ram_mb=400), claim("c", ram_mb=1))
    assert holders(book) == ["a", "b"]


def test_what_took_more_than_was_asked_for_makes_the_next_one_wait():
    book = amend(filled(claim("a", ram_mb=600)), "a", {"ram_mb": 1100}, 0)
    assert book.used("ram_mb") == 1100
    assert ask(book, claim("b", ram_mb=1), 0).waits("b")
    less = amend(ask(book, claim("b", ram_mb=300), 0), "a", {"ram_mb": 700}, 0)
    assert holders(less) == ["a", "b"]
    assert amend(less, "nobody", {"ram_mb": 5}, 0) == less


def test_a_higher_priority_goes_first_but_takes_nothing_away():
    book = filled(claim("a", base=1), claim("b", base=1), claim("c", priority=1, base=1))
    assert holders(book) == ["a"]
    book = release(book, ["a"], 0)
    assert holders(book) == ["c"]
    assert holders(release(book, ["c"], 0)) == ["b"]


def test_one_that_waits_too_long_is_forgotten_and_those_behind_it_go_on():
    book = filled(claim("a", base=1), claim("b", expires_ns=10, base=1, head=1), claim("c", head=1))
    book = settle(book, 9)
    assert book.waits("b")
    book = settle(book, 10)
    assert (book.waits("b"), book.holds("c")) == (False, True)


@pytest.mark.parametrize(
    ("wants", "message"),
    [
        ({"ram_mb": 1001}, "a asks for 1001 of ram_mb, expected 1 to 1000"),
        ({"base": 0}, "a asks for 0 of base, expected 1 to 1"),
        ({"wings": 1}, "a asks for wings, which nobody declares; known: base, head"),
    ],
)
def test_what_can_never_be_granted_is_refused(wants: dict[str, int], message: str):
    with pytest.raises(ClaimRefused, match=message):
        ask(BODY, claim("a", **wants), 0)


def test_a_holder_asks_once_for_all():
    with pytest.raises(ClaimRefused, match="ask for all at once"):
        filled(claim("a", base=1), claim("a", head=1))


def test_a_refusal_names_who_holds_what():
    book = filled(claim("pick_up of c7", base=1), claim("detector", ram_mb=600))
    wants = {"base": 1, "ram_mb": 600}
    assert obstacles(book, wants) == (
        "base is held by pick_up of c7; ram_mb is held by detector (600)"
    )
    book = filled(claim("a", base=1), claim("b", base=1, head=1))
    assert obstacles(book, {"head": 1}) == "b waits before it"
    assert obstacles(book, {"left_arm": 1}) == ""


def test_less_capacity_takes_nothing_away_and_more_serves_who_waits():
    book = declare(filled(claim("a", ram_mb=900), claim("b", ram_mb=300)), {"ram_mb": 500}, 0)
    assert holders(book) == ["a"]
    assert declare(book, {"ram_mb": 1200}, 0).holds("b")


RESOURCES = ("base", "head", "left_arm", "ram_mb")
WANTS = st.dictionaries(st.sampled_from(RESOURCES), st.just(1), min_size=1).map(
    lambda wants: {**wants, **({"ram_mb": 400} if "ram_mb" in wants else {})}
)
STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("ask"), st.integers(0, 9), WANTS, st.integers(0, 2)),
        st.tuples(st.just("release"), st.integers(0, 9)),
        st.tuples(st.just("wait"), st.integers(0, 5)),
    ),
    max_size=60,
)


@given(STEPS)
def test_nothing_is_ever_oversubscribed_and_everyone_is_served_when_releases_come(steps):
    book, now_ns = BODY, 0
    for kind, number, *rest in steps:
        if kind == "ask" and not (book.holds(f"h{number}") or book.waits(f"h{number}")):
            book = ask(book, claim(f"h{number}", priority=rest[1], **rest[0]), now_ns)
        elif kind == "release":
            book = release(book, [f"h{number}"], now_ns)
        elif kind == "wait":
            now_ns += number
            book = settle(book, now_ns)
        assert all(book.used(name) <= most for name, most in book.capacities.items())
        assert len({one.holder for one in (*book.granted, *book.waiting)}) == len(
            book.granted
        ) + len(book.waiting)
    for _ in range(len(book.waiting) + len(book.granted)):
        book = release(book, [one.holder for one in book.granted[:1]], now_ns)
    assert (book.granted, book.waiting) == ((), ())


def test_a_holder_takes_back_what_it_has_left_as_soon_as_that_is_free():
    both = {"base": 1, "head": 1}
    book = ask(amend(filled(claim("a", **both)), "a", {"base": 1}, 0), claim("b", head=1), 0)
    assert holders(book) == ["a", "b"]
    assert widen(book, "a", both) == book
    book = ask(book, claim("c", head=1), 0)
    free = replace(book, granted=book.granted[:1])
    assert widen(free, "a", both).granted[0].wants == both
    assert widen(free, "a", both).waits("c")
    assert widen(free, "stranger", both) == free
