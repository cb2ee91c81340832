import pytest

from vla_deploy.robots import load_robot
from vla_deploy.world.surfaces import MOST_SURFACES, SurfaceBook, furniture_points

Corners = tuple[tuple[float, float], ...]


def square(x_m: float, y_m: float, side_m: float = 0.4) -> Corners:
    half = side_m / 2
    return tuple((x_m + i * half, y_m + j * half) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1)))


def test_parts_of_one_table_seen_in_turn_are_one_surface() -> None:
    book = SurfaceBook()
    names = {book.look(0.45, square(x_m, 0.0)) for x_m in (0.0, 0.45, 0.9)}
    assert names == {"surface_1"}
    (table,) = book.surfaces
    xs = [x_m for x_m, _ in table.polygon_m]
    assert (min(xs), max(xs)) == pytest.approx((-0.2, 1.1))


def test_another_height_or_another_end_of_the_room_is_another_surface() -> None:
    book = SurfaceBook()
    names = [book.look(0.45, square(0.0, 0.0)), book.look(0.5, square(0.0, 0.0)),
             book.look(0.45, square(2.0, 0.0))]  # fmt: skip
    assert names == ["surface_1", "surface_2", "surface_3"]


def test_the_furniture_of_a_place_has_its_name_also_when_seen_in_part() -> None:
    furniture = {"coffee_table": (2.2, 1.55)}
    assert SurfaceBook(furniture).look(0.45, square(2.0, 1.5)) == "coffee_table"
    assert SurfaceBook(furniture).look(0.45, square(1.8, 1.5)) == "coffee_table"
    assert SurfaceBook(furniture).look(0.45, square(1.2, 1.5)) == "surface_1"
    assert SurfaceBook(furniture).look(0.02, square(2.0, 1.5)) == "surface_1"


def test_the_butlers_furniture_is_named_by_the_most_particular_place() -> None:
    points = furniture_points(load_robot("butler").places)
    assert set(points) == {"coffee_table", "side_table", "kitchen_table", "bedside_table"}
    assert points["coffee_table"] == (2.2, 1.55)


def test_the_number_of_surfaces_is_bounded() -> None:
    book = SurfaceBook()
    for number in range(2 * MOST_SURFACES):
        book.look(0.45, square(2.0 * number, 0.0))
    assert len(book.surfaces) == MOST_SURFACES
    assert book.look(0.45, square(2.0 * (2 * MOST_SURFACES - 1), 0.0)) == "surface_48"
