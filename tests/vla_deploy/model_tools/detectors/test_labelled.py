import json
import math

import cv2
import numpy as np
import pytest

from vla_deploy.inference.errors import ImagesInvalid
from vla_deploy.model_tools.detectors.labelled import read_image, read_labelled, spread_paths

CLASSES = ("cup", "ball")


@pytest.fixture
def image(tmp_path):
    """Write an image of 200 x 100 pixels, red on the left."""

    def image(name: str):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True, parents=True)
        bgr = np.zeros((100, 200, 3), dtype=np.uint8)
        bgr[:, :100, 2] = 255
        cv2.imwrite(str(path), bgr)
        return path

    return image


def coco(**changes) -> dict:
    return {
        "images": [{"id": 7, "file_name": "a.png"}, {"id": 8, "file_name": "b.png"}],
        "annotations": [{"image_id": 7, "category_id": 3, "bbox": [10, 20, 30, 40]}],
        "categories": [{"id": 3, "name": "ball"}, {"id": 1, "name": "cup"}],
        **changes,
    }


@pytest.mark.parametrize(
    ("picture", "label"), [("images/a.png", "labels/a.txt"), ("a.png", "a.txt")]
)
def test_yolo_files_are_found_beside_and_in_labels(tmp_path, image, picture, label):
    image(picture)
    (tmp_path / label).parent.mkdir(exist_ok=True)
    (tmp_path / label).write_text("1 0.5 0.5 0.1 0.2\n\n0 0.25 0.5 0.5 1\n")
    (one,) = read_labelled(tmp_path, CLASSES)
    rgb, labels = one.read()
    assert labels.classes.tolist() == [1, 0]
    assert labels.corners_px == pytest.approx(np.array([[90, 40, 110, 60], [0, 0, 100, 100]]))
    assert rgb[50, 50].tolist() == [255, 0, 0]


def test_an_image_without_labels_shows_nothing_as_long_as_others_have_some(tmp_path, image):
    image("a.png")
    image("b.png")
    with pytest.raises(ImagesInvalid, match=r"no image has labels; the first would be .*a\.txt"):
        read_labelled(tmp_path, CLASSES)
    (tmp_path / "b.txt").write_text("0 0.5 0.5 0.1 0.1\n")
    assert [len(one.classes) for one in read_labelled(tmp_path, CLASSES)] == [0, 1]


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("0 0.5 0.5 0.1", "a.txt:1: expected class, x, y, width, height as shares of the image"),
        ("cup 0.5 0.5 0.1 0.1", "a.txt:1: expected class, x, y, width, height as shares of the"),
        ("2 0.5 0.5 0.1 0.1", "a.txt:1: expected a class from 0 to 1, as the model has, got 2"),
        ("0.5 0.5 0.5 0.1 0.1", "a.txt:1: expected a class from 0 to 1"),
        ("0 100 50 20 20", "a.txt:1: expected shares of the image from 0 to 1, got '0 100 50"),
        ("0 nan 0.5 0.1 0.1", "a.txt:1: expected shares of the image from 0 to 1"),
    ],
)
def test_a_line_that_is_no_label_is_told(tmp_path, image, line, told):
    image("a.png")
    (tmp_path / "a.txt").write_text(line)
    with pytest.raises(ImagesInvalid) as caught:
        read_labelled(tmp_path, CLASSES)
    assert told in str(caught.value)


@pytest.mark.parametrize("name", ["a.txt", "classes.txt"])
def test_labels_that_are_no_text_are_told(tmp_path, image, name):
    image("a.png")
    (tmp_path / name).write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ImagesInvalid, match=f"{name}: expected a text file in UTF-8"):
        read_labelled(tmp_path, CLASSES)


def test_a_list_of_classes_in_another_order_is_told(tmp_path, image):
    image("a.png")
    (tmp_path / "classes.txt").write_text("ball\ncup\n")
    with pytest.raises(ImagesInvalid, match=r"expected the model's classes \['cup', 'ball'\], got"):
        read_labelled(tmp_path, CLASSES)


@pytest.mark.parametrize("folder", ["", "images/"])
def test_a_coco_file_is_read_by_the_names_of_its_categories(tmp_path, image, folder):
    image(f"{folder}a.png")
    image(f"{folder}b.png")
    (tmp_path / "all.json").write_text(json.dumps(coco()))
    first, second = read_labelled(tmp_path / "all.json", CLASSES)
    labels = first.read()[1]
    assert labels.classes.tolist() == [1]
    assert labels.corners_px.tolist() == [[10, 20, 40, 60]]
    assert len(second.classes) == 0
    assert first.path.name == "a.png"


@pytest.mark.parametrize(
    ("document", "told"),
    [
        ("[", "expected a COCO file: "),
        ("[]", "it has no list images, annotations, categories"),
        ({"categories": 3}, "it has no list categories"),
        ({"annotations": [{"image_id": 7}]}, "annotations[0] has no category_id, bbox"),
        ({"categories": [{"id": 1, "name": "dog"}]}, "categories ['dog'] are none of the model's"),
        (
            {"annotations": [{"image_id": 9, "category_id": 3, "bbox": [0, 0, 1, 1]}]},
            "annotations name images ['9'], unknown",
        ),
        (
            {"annotations": [{"image_id": 7, "category_id": 4, "bbox": [0, 0, 1, 1]}]},
            "category 4 is not declared",
        ),
        (
            {"annotations": [{"image_id": 7, "category_id": 3, "bbox": [5, 5, 0, 1]}]},
            "bbox: expected left, top, width, height, got [5, 5, 0, 1]",
        ),
        ({"images": [{"id": 7, "file_name": "c.png"}]}, "image 'c.png' is neither "),
        (
            {"images": [{"id": 7, "file_name": 7}]},
            "images[0].file_name: expected a text of one line, got 7",
        ),
        ({"images": [{"id": [7], "file_name": "a.png"}]}, "images[0].id: expected a number or a"),
        ({"categories": [{"id": [3], "name": "cup"}]}, "categories[0].id: expected a number or a"),
        (
            {"categories": [{"id": 3, "name": ["cup"]}]},
            "categories[0].name: expected a text of one line, got",
        ),
        (
            {"annotations": [{"image_id": [7], "category_id": 3, "bbox": [5, 5, 1, 1]}]},
            "annotations[0].image_id: expected a number or a text, got [7]",
        ),
        *(
            (
                {"annotations": [{"image_id": 7, "category_id": 3, "bbox": [5, 5, *size]}]},
                "annotations[0].bbox: expected left, top, width, height, got [5, 5, ",
            )
            for size in (["x", 8], [math.nan, 1], [1, math.inf], [True, 1])
        ),
    ],
)
def test_a_coco_file_with_a_fault_is_told(tmp_path, image, document, told):
    image("a.png")
    image("b.png")
    text = document if isinstance(document, str) else json.dumps(coco(**document))
    (tmp_path / "all.json").write_text(text)
    with pytest.raises(ImagesInvalid) as caught:
        read_labelled(tmp_path / "all.json", CLASSES)
    assert told in str(caught.value)


def test_what_holds_no_images_is_told(tmp_path):
    with pytest.raises(ImagesInvalid, match=r"holds no image; expected files ending in \.bmp, "):
        spread_paths(tmp_path, 3)
    with pytest.raises(ImagesInvalid, match="no such folder"):
        spread_paths(tmp_path / "none", 3)
    with pytest.raises(ImagesInvalid, match="expected a folder with labels, or a COCO file"):
        read_labelled(tmp_path / "none", CLASSES)


def test_a_spoiled_image_is_told(tmp_path):
    (tmp_path / "a.jpg").write_bytes(b"no image")
    with pytest.raises(ImagesInvalid, match=r"a\.jpg: no image that can be read"):
        read_image(tmp_path / "a.jpg")


def test_fewer_images_are_spread_over_all(tmp_path, image):
    for number in range(10):
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.full((4, 4, 3), number, dtype=np.uint8))
    assert [path.stem for path in spread_paths(tmp_path, 4)] == ["0", "2", "5", "7"]
    assert len(spread_paths(tmp_path, 99)) == 10
