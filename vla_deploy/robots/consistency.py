"""Find what contradicts itself in a robot file.

Every check works on the raw document and passes over values of the wrong kind: the schema has
reported those already.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from math import pi
from pathlib import Path
from typing import Any

from drivers.errors import UnknownModel
from drivers.power_relay.open_relay import PULSED
from drivers.registry import SensorKind, model_names, sensor_model
from drivers.servo.family import family_of
from vla_deploy.robots.battery_settings import battery_is_usable
from vla_deploy.robots.camera import MOST_PIXELS
from vla_deploy.runtime.table_schema import TableFault, is_number

Document = Mapping[str, Any]
DEVICES = (
    *("servo_bus", "can_bus", "lidar", "imu", "camera"),
    *("estop", "power_relay", "microphone", "speaker"),
)


def table(document: Document, key: object) -> Document:
    """Return a sub-table, or an empty one where the file holds something else."""
    value = document.get(key) if isinstance(key, str) else None
    return value if isinstance(value, dict) else {}


def subtables(document: Document, key: str) -> dict[str, Document]:
    """Return the tables inside a table, by name."""
    return {name: row for name, row in table(document, key).items() if isinstance(row, dict)}


def rows(record: Document, key: str) -> list[Document]:
    """Return the tables of a list in order, an empty one for anything else in it."""
    value = record.get(key)
    return (
        [row if isinstance(row, dict) else {} for row in value] if isinstance(value, list) else []
    )


def texts(record: Document, key: str) -> list[str]:
    """Return the texts of a list."""
    value = record.get(key)
    return [item for item in value if isinstance(item, str)] if isinstance(value, list) else []


def unknown_name(key: str, name: str, kind: str, known: Collection[str]) -> TableFault:
    """Return the fault of a name that nothing bears, with the names there are."""
    listed = ", ".join(sorted(known)) or "there is none"
    return TableFault(key=key, got=repr(name), expected=f"{kind}: {listed}")


def _servos(document: Document) -> list[Document]:
    return rows(table(document, "servo_bus"), "servos")


def _motors(document: Document) -> list[tuple[str, Document]]:
    """Return the servos, their shadows and those that turn wheels, with their keys."""
    bus = table(document, "servo_bus")
    return [
        (f"servo_bus.{kind}[{i}]", row)
        for kind in ("servos", "shadows", "wheels")
        for i, row in enumerate(rows(bus, kind))
    ]


def _drives(document: Document) -> list[Document]:
    return rows(table(document, "can_bus"), "drives")


def wheels(document: Document) -> list[Document]:
    """Return what turns wheels: the drives of the CAN bus, and servos of the servo bus."""
    return [*_drives(document), *rows(table(document, "servo_bus"), "wheels")]


def _joints(records: list[Document]) -> set[str]:
    return {row["joint"] for row in records if isinstance(row.get("joint"), str)}


def repeats(
    values: Iterator[tuple[str, object]] | list[tuple[str, object]],
) -> Iterator[TableFault]:
    """Yield a fault for each value that an earlier key has."""
    first: dict[object, str] = {}
    for key, value in values:
        if not isinstance(value, str | int):
            continue
        if value in first:
            yield TableFault(
                key=key, got=repr(value), expected=f"a value not used by {first[value]}"
            )
        first.setdefault(value, key)


def nothing_used_twice(document: Document) -> Iterator[TableFault]:
    """Servo ids, node ids, driven joints and device names are unique."""
    motors = _motors(document)
    shadows = [(key, row) for key, row in motors if ".shadows[" in key]
    servos = [(key, row) for key, row in motors if ".shadows[" not in key]
    drives = [(f"can_bus.drives[{i}]", row) for i, row in enumerate(_drives(document))]
    yield from repeats([(f"{key}.id", row.get("id")) for key, row in motors])
    yield from repeats([(f"{key}.node_id", row.get("node_id")) for key, row in drives])
    yield from repeats([(f"{key}.joint", row.get("joint")) for key, row in servos + drives])
    yield from repeats([(f"{key}.joint", row.get("joint")) for key, row in shadows])
    yield from repeats([(f"{d}.device", table(document, d).get("device")) for d in DEVICES])


NODE_IDS: Mapping[str, range] = {"cia402": range(1, 127), "odrive": range(0x3F)}


def parts_come_together(document: Document) -> Iterator[TableFault]:
    """What drives needs a base, a home the lidar that finds it, what guards a base needs one."""
    if "base" not in document:
        for key in (one for one in ("zones", "tip_over") if one in document):
            yield TableFault(key=key, got="a table", expected="nothing: the robot has no base")
    needs = {"can_bus": ("base",), "home": ("base", "lidar"), "tip_over": ("imu",)}
    if "lidar" in document:
        needs["base"] = ("home",)
    missing: dict[str, str] = {}
    for key in (one for one in needs if one in document):
        missing.update({one: key for one in needs[key] if one not in document})
    for key, needing in missing.items():
        yield TableFault(key=key, got="nothing", expected=f"a table: [{needing}] needs it")


def drives_fit_protocol(document: Document) -> Iterator[TableFault]:
    """Node ids are those of the protocol, and ODrive axes have their list of endpoints."""
    bus = table(document, "can_bus")
    protocol = bus.get("protocol", "cia402")
    allowed = NODE_IDS.get(protocol) if isinstance(protocol, str) else None
    if allowed is None:
        return
    for i, row in enumerate(_drives(document)):
        node_id = row.get("node_id")
        if isinstance(node_id, int) and node_id not in allowed:
            yield TableFault(
                key=f"can_bus.drives[{i}].node_id",
                got=repr(node_id),
                expected=f"an integer in {allowed[0]}..{allowed[-1]}, as {protocol} has them",
            )
    if protocol == "odrive" and "endpoints" not in bus:
        yield TableFault(
            key="can_bus.endpoints",
            got="nothing",
            expected="the flat_endpoints.json of the axes' firmware: it arms their watchdog",
        )


def models_are_listed(document: Document) -> Iterator[TableFault]:
    """Each servo's model has its datasheet figures."""
    models = subtables(document, "servo_models")
    for key, row in _motors(document):
        model = row.get("model")
        if isinstance(model, str) and model not in models:
            yield unknown_name(f"{key}.model", model, "a key of servo_models", models)


def shadows_have_leaders(document: Document) -> Iterator[TableFault]:
    """A shadow turns a servo's joint, and is of that servo's model."""
    leaders = {row.get("joint"): row for row in _servos(document)}
    for key, row in _motors(document):
        joint, model = row.get("joint"), row.get("model")
        if ".shadows[" not in key or not isinstance(joint, str):
            continue
        if joint not in leaders:
            yield unknown_name(f"{key}.joint", joint, "a servo's joint", _joints(_servos(document)))
        elif model != (leader := leaders[joint].get("model")):
            expected = f"{leader}, as the servo that it shadows"
            yield TableFault(key=f"{key}.model", got=repr(model), expected=expected)


def servos_have_one_driver(document: Document) -> Iterator[TableFault]:
    """One driver knows all servos of the bus, by their ids too, and can set them to its speed."""
    protocols: dict[str, str] = {}
    families = []
    for key, row in _motors(document):
        model, servo_id = row.get("model"), row.get("id")
        if not isinstance(model, str):
            continue
        try:
            family = family_of(model)
            if isinstance(servo_id, int):
                family.servo(
                    servo_id=servo_id,
                    model_name=model,
                    joint=str(row.get("joint")),
                    sign=1,
                    offset_rad=0.0,
                    travel_per_rad=1.0,
                )
        except UnknownModel as error:
            expected = f"a model with a driver: {error}"
            yield TableFault(key=f"{key}.model", got=repr(model), expected=expected)
            continue
        except ValueError as error:
            yield TableFault(key=f"{key}.id", got=repr(servo_id), expected=f"another: {error}")
            continue
        families.append(family)
        protocols[f"{key}.model"] = family.facts(model).protocol
    if not families:
        return
    first, protocol = next(iter(protocols.items()))
    for key, other in protocols.items():
        if other != protocol:
            expected = f"one of {protocol}, as {first}: servos of a bus speak the same"
            yield TableFault(key=key, got=f"a servo that speaks {other}", expected=expected)
    baud, rates = table(document, "servo_bus").get("baud"), families[0].baud_rates
    if isinstance(baud, int) and baud not in rates:
        known = ", ".join(map(str, sorted(rates)))
        yield TableFault(key="servo_bus.baud", got=repr(baud), expected=f"one of {known}")


def limits_match_servos(document: Document) -> Iterator[TableFault]:
    """Each servo joint has limits, the lower below the upper."""
    limits, joints = subtables(document, "limits"), _joints(_servos(document))
    for joint in sorted(joints - limits.keys()):
        yield TableFault(key=f"limits.{joint}", got="nothing", expected="a table: it has a servo")
    for joint, row in limits.items():
        low, high = row.get("min"), row.get("max")
        if joint not in joints:
            yield unknown_name(f"limits.{joint}", joint, "a servo's joint", joints)
        elif is_number(low) and is_number(high) and not low < high:
            yield TableFault(key=f"limits.{joint}.min", got=repr(low), expected=f"below max {high}")


def servos_reach(document: Document) -> Iterator[TableFault]:
    """A servo's one turn covers its joint's limits, its no-load speed the velocity limit."""
    limits, models = table(document, "limits"), table(document, "servo_models")
    for _, row in _motors(document):
        joint, offset, travel = row.get("joint"), row.get("offset"), row.get("travel_per_rad")
        if not (is_number(offset) and is_number(travel)):
            continue
        bounds = table(limits, joint)
        for end in ("min", "max"):
            value = bounds.get(end)
            if is_number(value) and abs(value - offset) > pi * travel:
                expected = f"within {pi * travel:.4g} of the servo's offset {offset}"
                yield TableFault(key=f"limits.{joint}.{end}", got=repr(value), expected=expected)
        velocity, speed = bounds.get("velocity"), table(models, row.get("model"))
        no_load = speed.get("no_load_speed_rad_s")
        if is_number(velocity) and is_number(no_load) and velocity > no_load * travel:
            expected = f"at most the servo's no-load speed {no_load * travel:.4g}"
            yield TableFault(key=f"limits.{joint}.velocity", got=repr(velocity), expected=expected)


def groups_cover_joints(document: Document) -> Iterator[TableFault]:
    """Each driven joint is in exactly one group."""
    driven = _joints(_servos(document)) | _joints(wheels(document))
    placed: list[tuple[str, object]] = [
        (f"groups.{name}.joints", joint)
        for name, row in subtables(document, "groups").items()
        for joint in texts(row, "joints")
    ]
    yield from repeats(placed)
    for key, joint in placed:
        if joint not in driven:
            yield unknown_name(key, str(joint), "a driven joint", driven)
    for joint in sorted(driven - {joint for _, joint in placed}):
        yield TableFault(
            key="groups", got=f"no group with {joint}", expected="each joint in a group"
        )


def hands_name_groups(document: Document) -> Iterator[TableFault]:
    """A hand names two groups; that of the gripper has one joint."""
    groups = subtables(document, "groups")
    for name, row in subtables(document, "hands").items():
        for part in ("arm", "gripper"):
            group = row.get(part)
            if isinstance(group, str) and group not in groups:
                yield unknown_name(f"hands.{name}.{part}", group, "a group", groups)
        joints = texts(table(groups, row.get("gripper")), "joints")
        if len(joints) > 1:
            got = f"a group of {len(joints)} joints"
            yield TableFault(key=f"hands.{name}.gripper", got=got, expected="a group of one joint")


def hands_that_see_reach(document: Document) -> Iterator[TableFault]:
    """Hands of a robot that sees take things: within its reach, each with a pose to travel in."""
    hands, poses = subtables(document, "hands"), subtables(document, "poses")
    takes = bool(hands) and "camera" in document
    if takes and "reach" not in document:
        yield TableFault(
            key="reach", got="nothing", expected="a table: hands and a camera are to take things"
        )
    for name, row in hands.items():
        key, pose = f"hands.{name}.travel_pose", row.get("travel_pose")
        if pose is None and takes:
            yield TableFault(key=key, got="nothing", expected="the pose in which its arm travels")
        elif isinstance(pose, str) and pose not in poses:
            yield unknown_name(key, pose, "a pose", poses)
        elif isinstance(pose, str):
            joints = texts(table(table(document, "groups"), row.get("arm")), "joints")
            for joint in (one for one in joints if one not in poses[pose]):
                yield TableFault(key=f"poses.{pose}", got=f"no {joint}", expected=f"it, for {key}")


def images_fit_their_ring(document: Document) -> Iterator[TableFault]:
    """An image is no larger than what processes share of it."""
    camera = table(document, "camera")
    width, height = camera.get("width"), camera.get("height")
    if is_number(width) and is_number(height) and width * height > MOST_PIXELS:
        yield TableFault(
            key="camera.width, camera.height",
            got=f"{width} x {height}",
            expected=f"at most {MOST_PIXELS} pixels together, as 640 x 480 has: set a smaller "
            "size, which the camera or its driver scales to",
        )


def cameras_without_depth_stand_still(document: Document) -> Iterator[TableFault]:
    """A camera without depth is a mounted robot's, whose hands take things of known sizes."""
    model = table(document, "camera").get("model")
    if not isinstance(model, str) or model not in model_names(SensorKind.CAMERA):
        return
    if sensor_model(SensorKind.CAMERA, model).has_depth:
        return
    if "base" in document or "head" in document:
        yield TableFault(
            key="camera.model",
            got=f"{model!r}, a camera without depth, on a robot with a base or a head",
            expected="a camera with depth; only one that stands fixed over the table of a mounted "
            "robot can do without",
        )
    if "hands" in document and not rows(document, "things"):
        yield TableFault(
            key="things",
            got="nothing",
            expected="a [[things]] table with class and size_m for each kind to take: a camera "
            "without depth places things by their sizes",
        )


def head_turns_by_servos(document: Document) -> Iterator[TableFault]:
    """The joints of the head are servos', and it has a camera to turn."""
    head, joints = table(document, "head"), _joints(_servos(document))
    if head and "camera" not in document:
        yield TableFault(key="camera", got="nothing", expected="a table: [head] turns it")
    for key in ("pan", "tilt"):
        joint = head.get(key)
        if isinstance(joint, str) and joint not in joints:
            yield unknown_name(f"head.{key}", joint, "a servo's joint", joints)


def poses_are_reachable(document: Document) -> Iterator[TableFault]:
    """A pose names servo joints and stays inside their limits."""
    limits, joints = table(document, "limits"), _joints(_servos(document))
    for name, targets in table(document, "poses").items():
        if not isinstance(targets, dict):
            key = f"poses.{name}"
            yield TableFault(key=key, got=repr(targets), expected="a table of joint = position")
            continue
        for joint, value in targets.items():
            yield from _pose_target(f"poses.{name}.{joint}", joint, value, joints, limits)


def _pose_target(
    key: str, joint: str, value: object, joints: set[str], limits: Document
) -> Iterator[TableFault]:
    bounds = table(limits, joint)
    low, high = bounds.get("min"), bounds.get("max")
    if joint not in joints:
        yield unknown_name(key, joint, "a servo's joint", joints)
    elif not is_number(value):
        yield TableFault(key=key, got=repr(value), expected="a number")
    elif is_number(low) and is_number(high) and not low <= value <= high:
        yield TableFault(key=key, got=repr(value), expected=f"inside the limits {low}..{high}")


def places_are_distinct(document: Document) -> Iterator[TableFault]:
    """The start is a place; no two places share a name or an alias."""
    home = table(document, "home")
    places = subtables(home, "places")
    start = home.get("start")
    if isinstance(start, str) and start not in places:
        yield unknown_name("home.start", start, "a place", places)
    words: list[tuple[str, object]] = [(f"home.places.{name}", name) for name in places]
    for name, row in places.items():
        words += [(f"home.places.{name}.aliases", alias) for alias in texts(row, "aliases")]
    yield from repeats(words)


def ros_is_on_where_needed(document: Document) -> Iterator[TableFault]:
    """Yield a fault for each part that is moved over ROS by a robot that is in no ROS graph."""
    ros = table(document, "ros")
    for key in ("navigation", "arms"):
        if ros.get(key, "own") != "own" and ros.get("enabled") is not True:
            expected = 'enabled = true in [ros], or "own"'
            yield TableFault(
                key=f"ros.{key}", got=f"{ros[key]!r} while ROS is off", expected=expected
            )


def relays_fall_by_themselves(document: Document) -> Iterator[TableFault]:
    """A relay on GPIO says how long its board holds it; one that is told has no such time."""
    relay = table(document, "power_relay")
    if not relay:
        return
    is_pulsed = relay.get("model") == PULSED
    if is_pulsed and "hold_s" not in relay:
        expected = "how long the board's monostable holds the relay after a pulse"
        yield TableFault(key="power_relay.hold_s", got="nothing", expected=expected)
    if not is_pulsed and "hold_s" in relay:
        expected = f"nothing: only a board that falls without pulses has it, on {PULSED}"
        yield TableFault(key="power_relay.hold_s", got=repr(relay["hold_s"]), expected=expected)


def leaders_have_no_power(document: Document) -> Iterator[TableFault]:
    """A robot that is only read keeps no power through a stop, and has nothing that drives it."""
    if document.get("read_only") is not True:
        return
    for key in (one for one in ("base", "head", "hands", "calibration") if one in document):
        yield TableFault(key=key, got="a table", expected="nothing: the robot is only read")
    for name, row in subtables(document, "groups").items():
        if (category := row.get("stop_category")) != 0:
            expected = "0, no power: the robot is only read"
            yield TableFault(
                key=f"groups.{name}.stop_category", got=repr(category), expected=expected
            )


CHECKS: tuple[Callable[[Document], Iterator[TableFault]], ...] = (
    nothing_used_twice,
    parts_come_together,
    drives_fit_protocol,
    models_are_listed,
    shadows_have_leaders,
    servos_have_one_driver,
    limits_match_servos,
    servos_reach,
    groups_cover_joints,
    hands_name_groups,
    hands_that_see_reach,
    cameras_without_depth_stand_still,
    images_fit_their_ring,
    head_turns_by_servos,
    poses_are_reachable,
    places_are_distinct,
    ros_is_on_where_needed,
    battery_is_usable,
    leaders_have_no_power,
    relays_fall_by_themselves,
)


def mjcf_file(name: str, directory: Path) -> Path:
    """Return an MJCF in a robot's folder, or one of a robot that comes with the stack.

    So an arm of another's geometry names that one's file, such as `so101/so101.xml`.
    """
    own = directory / name
    shared = Path(__file__).parent / name
    return shared if shared.is_file() and not own.is_file() else own


def missing_files(document: Document, directory: Path) -> Iterator[TableFault]:
    """Yield a fault for each file that the robot file names and that is not there."""
    can_bus = table(document, "can_bus")
    if isinstance(name := document.get("mjcf"), str) and not mjcf_file(name, directory).is_file():
        yield TableFault(key="mjcf", got=repr(name), expected=f"a file under {directory}")
    named = (
        ("home.map", table(document, "home").get("map")),
        ("can_bus.eds", can_bus.get("eds")),
        ("can_bus.endpoints", can_bus.get("endpoints")),
    )
    for key, name in named:
        if isinstance(name, str) and not (directory / name).is_file():
            yield TableFault(key=key, got=repr(name), expected=f"a file under {directory}")
