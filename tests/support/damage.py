"""Refusals of damaged files of instances and fields, and changes that damage their JSON documents."""

import crossfield as cf
import numpy as np
import pytest

MASK = np.array([[1, 1, 0, 1], [1, 1, 0, 0], [0, 1, 1, 0]], dtype=bool)


def full_instance():
    """An instance in which no attribute has its default."""
    return cf.Instance.on_pixels(
        name="sample",
        mask=MASK,
        stroke_pixels=[[0, 0], [1, 1], [2, 2]],
        theta=[0.1, 1 / 3, 2.9],
        w=[1.0, 0.1, 2 / 3],
        stroke_coefficient=0.5,
        skew_coefficient=1e-7,
        gauge="box",
        source='a "quoted" sketch.svg, Größe',
        pixel_size=2.5,
        origin=(-1.25, 1e-3),
    )


def refused(read, path, message, error=cf.InstanceError):
    with pytest.raises(error) as caught:
        read(path)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert message in text
    assert "\n" not in text


def change(key, value):
    return lambda document: document | {key: value}


def without(key):
    return lambda document: {k: v for k, v in document.items() if k != key}
