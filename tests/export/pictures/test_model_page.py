"""The model on the page of a run, which a browser turns without a network."""

import json

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.pictures.mesh_view import MOST_TURNED, model_data
from crossfield.models.mesh.shapes import blocks, star
from crossfield.templates import ENVIRONMENT

MOST_BYTES = 200_000


def flat_angles(mesh):
    """The field whose angles are 0 in every frame."""
    instance = cf.Instance.on_faces("part", mesh, [], [], [])
    nothing = np.zeros(mesh.size)
    return cf.CrossField(instance, nothing, nothing, np.zeros(len(mesh.first), int)).with_best_jumps()


def page_of(field):
    model = json.dumps(model_data(field))
    text = ENVIRONMENT.get_template("run/model.html.j2").render(model=model)
    return "<!doctype html><meta charset=utf-8><title>model</title>" + text


def test_the_largest_model_has_at_most_200_kilobytes():
    mesh = blocks(np.ones((22, 22, 23), dtype=bool))
    assert 0.95 * MOST_TURNED < mesh.size <= MOST_TURNED
    assert len(page_of(flat_angles(mesh)).encode()) < MOST_BYTES
    assert model_data(flat_angles(star(25))) is None


@pytest.mark.slow
def test_keys_and_the_mouse_turn_the_model(browser, tmp_path):
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    path = tmp_path / "page.html"
    path.write_text(page_of(flat_angles(blocks(np.ones((2, 3, 4), dtype=bool)))))
    browser.get(path.as_uri())
    canvas = browser.find_element("id", "model")
    picture = "return document.getElementById('model').toDataURL()"
    views = [browser.execute_script(picture)]
    canvas.send_keys(Keys.ARROW_LEFT)
    views.append(browser.execute_script(picture))
    ActionChains(browser).click_and_hold(canvas).move_by_offset(60, 20).release().perform()
    views.append(browser.execute_script(picture))
    canvas.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_LEFT)
    assert len(set(views)) == 3
    assert min(map(len, views)) > 10_000
    # A turn to the left and back shows the same again, but for rounding.
    assert abs(len(browser.execute_script(picture)) - len(views[-1])) < 0.01 * len(views[-1])
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
