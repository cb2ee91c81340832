import json
from functools import partial
from pathlib import Path

import cv2
import pytest

from vla_deploy.runtime.state_dir import models_dir_of

SHIPPED = {"command_parser", "commands-whisper", "detector", "stop_words"}


@pytest.fixture
def vla(vla):
    return partial(vla, "models")


@pytest.fixture
def files(tmp_path, blobs):
    """Write a person's model, class list and labelled photographs; return where each is."""
    onnx_file, classes, photos = tmp_path / "b.onnx", tmp_path / "names.txt", tmp_path / "photos"
    onnx_file.write_bytes(blobs.raw().SerializeToString())
    classes.write_text("red\ngreen\nblue\n")
    others = tmp_path / "others"
    for folder, seeds in ((photos, range(4)), (others, range(4, 8))):
        folder.mkdir()
        for seed in seeds:
            rgb, things = blobs.photograph(seed)
            cv2.imwrite(str(folder / f"{seed}.png"), rgb[..., ::-1])
            rows = [
                f"{number} {x / 96} {y / 64} {blobs.box_px / 96} {blobs.box_px / 64}"
                for number, x, y in things
            ]
            (folder / f"{seed}.txt").write_text("\n".join(rows))
    paths = {"onnx": onnx_file, "classes": classes, "photos": photos, "others": others}
    return {name: str(path) for name, path in paths.items()}


@pytest.fixture
def add(vla, files):
    return partial(vla, "add", "mugs", "--onnx", files["onnx"], "--classes", files["classes"])


@pytest.fixture
def added(add):
    code, _, errors = add()
    assert (code, errors) == (0, "")
    return "mugs"


@pytest.mark.parametrize(
    ("option", "value"),
    [("--score", "7"), ("--score", "nan"), ("--iou", "5"), ("--fill", "999"), ("--licence", "")],
)
def test_a_model_that_could_not_be_read_back_is_not_added(vla, add, option, value):
    code, _, errors = add(option, value)
    assert code == 2
    assert option.strip("-") in errors.replace("score_threshold", "score")
    assert "mugs" not in vla("list")[1]


def test_a_model_is_added_listed_shown_and_removed(vla, add, base):
    code, out, _ = add("--json")
    assert code == 0
    assert json.loads(out)["adapter"] == "yolo"
    _, out, _ = vla("list", "--json")
    row = next(row for row in json.loads(out) if row["name"] == "mugs")
    assert (row["role"], row["from"], list(row["files"])) == ("detector", "added", ["fp32"])
    shown = json.loads(vla("show", "mugs", "--json")[1])
    assert shown["detection"]["classes"] == ["red", "green", "blue"]
    assert shown["folder"] == str(models_dir_of(base) / "mugs")
    assert vla("remove", "mugs")[0] == 0
    assert not (models_dir_of(base) / "mugs").exists()


def test_list_tells_which_profiles_use_a_model_and_which_are_missing(vla):
    rows = {row["name"]: row for row in json.loads(vla("list", "--json")[1])}
    whisper = rows["whisper-tiny.en"]
    assert "jetson_orin_nano_4gb speech_to_text tier 0" in whisper["used_by"]
    assert whisper["from"] == "missing"
    _, out, _ = vla("list")
    (line,) = (line for line in out.splitlines() if line.startswith("whisper-tiny.en "))
    assert "named by profiles only" in line


def test_a_spoiled_model_is_listed_as_such(vla, added, base):
    (models_dir_of(base) / added / "model.toml").write_text("name = ")
    row = next(r for r in json.loads(vla("list", "--json")[1]) if r["name"] == added)
    assert row["from"] == "spoiled"
    assert "expected a TOML document" in row["fault"]


def test_what_is_wrong_with_a_model_is_one_line_and_code_2(vla, files, tmp_path):
    few = tmp_path / "few.txt"
    few.write_text("red\n")
    code, _, errors = vla(
        "add", "x", "--onnx", files["onnx"], "--classes", str(few), "--adapter", "yolo"
    )
    assert code == 2
    assert errors.startswith(f"vla-deploy: {files['onnx']}: adapter yolo: expected one output")


def test_quantise_makes_the_files_that_bench_then_measures(vla, files, added):
    code, out, _ = vla(
        "quantise", added, "--images", files["others"], "--labelled", files["photos"]
    )
    assert code == 0
    assert "over 4 images with 12 things; drop 0.00 points; installed as mugs" in out
    code, out, _ = vla("bench", added, "--rounds", "3", "--profile", "desktop", "--json")
    figures = json.loads(out)
    assert (code, figures["threads"]) == (0, 1)
    assert [row["variant"] for row in figures["rows"]] == ["fp32", "int8_u8s8"]
    assert figures["int8_speedup"] > 0
    code, out, _ = vla("bench", added, "--rounds", "2", "--images", files["photos"])
    assert "times as fast as fp32" in out


def test_images_to_measure_with_are_others_than_those_to_calibrate_with(
    vla, files, added, tmp_path
):
    again = tmp_path / "again"
    again.symlink_to(files["photos"])
    code, _, errors = vla("quantise", added, "--images", files["photos"], "--labelled", str(again))
    assert code == 2
    assert "4 of its 4 images, such as" in errors
    assert errors.count("\n") == 1


def test_calibrate_writes_down_what_a_detectors_words_are_worth(vla, files, add, added):
    assert "it names nothing by itself" in add("--replace")[1]
    assert "measured" not in json.loads(vla("show", added, "--json")[1])["detection"]
    code, out, _ = vla("calibrate", added, "--labelled", files["photos"])
    assert code == 0
    words = [line.split() for line in out.splitlines()]
    assert ["fp32", "mAP50", "1.0000"] in words
    assert ["red", "1.000", "4", "1.000", "4"] in words
    measured = json.loads(vla("show", added, "--json")[1])["detection"]["measured"]
    assert (measured["precision"], measured["things"]) == (1.0, 12)
    assert {one["name"]: one["boxes"] for one in measured["classes"]} == dict.fromkeys(
        ("red", "green", "blue"), 4
    )


def test_calibrate_takes_labelled_images_for_detectors_that_were_added_only(vla, files, added):
    code, _, errors = vla("calibrate", "detector", "--labelled", files["photos"])
    assert (code, "was not added as a detector" in errors) == (2, True)
    code, _, errors = vla("calibrate", added, "--sounds", files["photos"])
    assert (code, "was not added as a Whisper" in errors) == (2, True)


def test_a_quantised_model_that_sees_worse_is_refused_with_code_1(
    vla, files, add, added, base, blobs
):
    Path(files["onnx"]).write_bytes(blobs.raw(red_gain=3000.0).SerializeToString())
    add("--replace")
    code, _, errors = vla(
        "quantise", added, "--images", files["others"], "--labelled", files["photos"]
    )
    assert code == 1
    assert "points, allowed are 1 (fp32 1.0000" in errors
    assert not list((models_dir_of(base) / added).glob("*int8*"))


def test_verify_returns_1_when_a_check_fails(vla, added, base):
    code, out, _ = vla("verify", "--profile", "desktop")
    assert code == 0
    rows = [line.split()[:2] for line in out.splitlines()]
    assert {name for _, name in rows} == {added, *SHIPPED}
    assert {verdict for verdict, _ in rows} == {"ok"}
    assert [name for _, name in rows].count(added) == 4
    code, out, _ = vla("verify", added, "--profile", "jetson_orin_nx", "--json")
    assert code == 1
    (failed,) = (one for one in json.loads(out) if not one["is_ok"])
    assert failed["check"] == "profile jetson_orin_nx"
    assert "TensorrtExecutionProvider: this onnxruntime" in failed["detail"]
    (models_dir_of(base) / added / "mugs.onnx").write_bytes(b"cut")
    assert vla("verify", added, "--profile", "desktop")[0] == 1
