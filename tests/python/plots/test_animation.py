"""Animations: bodies where the run has them, pages without network, files that players open."""

import base64
import hashlib
import html
import json
import re
import shutil
import sys

import chebclear as cc
import numpy as np
import pytest
from chebclear.plots.animation import animate as module
from chebclear.plots.animation.film import GAP, arrows, journal_of
from chebclear.plots.animation.motion import moved, moving_mechanism
from chebclear.plots.drawing.pen import strokes_of
from chebclear.plots.drawing.pose import Pose, simulated_poses
from chebclear.plots.drawing.strokes import Enlarged
from PIL import Image
from refusals import refuses


def press():
    """A crank that turns a rod, whose loose wrist presses a ram on a spring."""
    return cc.Scene(
        bodies=[
            cc.Body("crank", 1.0, 1e-3, points={"A": (0.0, 0.0), "B": (0.05, 0.0)}, angle=0.5),
            cc.Body("rod", 0.8, 2e-3, (0.06, 0.01), points={"B": (0.0, 0.0), "C": (0.16, 0.0)}, angle=-0.15),
            cc.Body("ram", 2.0, 1e-3, points={"C": (0.0, 0.0), "tool": (0.03, 0.0)}),
        ],
        joints=[
            cc.Revolute("bearing", "ground.A", "crank.A"),
            cc.Revolute("pin", "crank.B", "rod.B"),
            cc.ClearanceRevolute("wrist", "rod.C", "ram.C", 0.01, 5e-5, cc.laws.Flores(1e10, 0.8)),
            cc.Prismatic("guide", "ground.A", "ram.C", axis=(1.0, 0.0)),
        ],
        forces=[
            cc.Spring("spring", "ground.wall", "ram.tool", stiffness=2000.0, length=0.12, damping=5.0),
            cc.Force("load", "ram.tool", x=-40.0, y=0.0),
            cc.TorsionDamper("oil", "ground", "crank", damping=0.2),
            cc.Gravity((0.0, -9.81)),
        ],
        ground={"A": (0.0, 0.0), "wall": (0.36, 0.0)},
        start=[cc.JointStart("bearing", velocity=40.0)],
    )


@pytest.fixture(scope="module")
def run():
    return cc.simulate(press(), duration=0.1, samples=801)


FRAMES = np.linspace(0, 800, 9).astype(int)


@pytest.fixture(scope="module")
def motion(run):
    return moving_mechanism(run.scene, simulated_poses(run)[FRAMES])


def test_every_stroke_goes_with_what_it_belongs_to(run, motion):
    poses = simulated_poses(run)
    first = Pose(run.scene, poses[0])
    for number, sample in enumerate(FRAMES):
        pose = Pose(run.scene, poses[sample])
        ends = ["ground.wall", "crank.B", "rod.B", "rod.C", "rod.center_of_mass", "ram.C", "ram.tool"]
        for end in ends:
            own = moved(motion.transforms[end.split(".")[0]], first.at(end)[None, :])[number, 0]
            np.testing.assert_allclose(own, pose.at(end), rtol=0.0, atol=1e-15)
        # A spring reaches from end to end, and does not become wider.
        stretched = motion.transforms["ground.wall", "ram.tool"]
        for end in ("ground.wall", "ram.tool"):
            np.testing.assert_allclose(
                moved(stretched, first.at(end)[None, :])[number, 0], pose.at(end), rtol=0.0, atol=1e-15
            )
        beside = moved(stretched, (first.at("ram.tool") + np.array([0.0, 0.01]))[None, :])[number, 0]
        np.testing.assert_allclose(beside - pose.at("ram.tool"), [0.0, 0.01], rtol=0.0, atol=1e-15)
        # A force given on ground's axes follows its point without turning.
        follows = motion.transforms["ram.tool", "ram.tool"][number]
        np.testing.assert_allclose(follows[:4], [1.0, 0.0, 0.0, 1.0])


def test_enlarged_play_is_that_of_a_drawing_in_every_frame():
    law = cc.laws.Hertz(1e9)
    points = {"S": (0.0, 0.1), "G": (0.1, 0.0), "R": (-0.1, 0.0), "B": (0.0, -0.1)}
    scene = cc.Scene(
        [cc.Body("holder", 1.0, 1e-2, points=points), *(cc.Body(name, 0.1, 1e-4) for name in "gspj")],
        [
            cc.ClearancePrismatic("guide", "holder.G", "g", (1.0, 0.5), 0.04, 0.02, 1e-4, law),
            cc.ClearancePrismatic(
                "sleeve", "holder.R", "s", (0.0, 1.0), 0.04, 0.02, 1e-4, law, corners="a", face_length=0.3
            ),
            cc.PinInSlot("slot", "holder.S", "p", (1.0, 1.0), 0.01, 1e-4, law),
            cc.ClearanceRevolute("bearing", "holder.B", "j", 0.01, 1e-4, law),
        ],
        [cc.Gravity((1.0, -9.81))],
        start=[cc.BodyStart("holder", angle=0.3, angular_velocity=5.0)],
    )
    run = cc.simulate(scene, duration=0.05, samples=6)
    poses = simulated_poses(run)
    moving = moving_mechanism(scene, poses, 50.0)
    for frame, pose in enumerate(poses):
        drawn = [
            one for one in strokes_of(Pose(scene, pose), 50.0).strokes if isinstance(one.owner, Enlarged)
        ]
        assert {stroke.owner.joint for stroke in drawn} == {"guide", "sleeve", "slot", "bearing"}
        for stroke in drawn:
            there = [
                moved(moving.transforms[one.owner], one.points)[frame]
                for one in moving.strokes
                if (one.owner, one.layer) == (stroke.owner, stroke.layer)
            ]
            np.testing.assert_allclose(there, [stroke.points], rtol=0.0, atol=1e-14)


def test_centers_of_mass_are_the_columns_of_the_run(run, motion):
    crosses = [stroke for stroke in motion.strokes if stroke.owner == "rod" and stroke.layer == 6]
    assert len(crosses) == 2
    for stroke in crosses:
        middle = moved(motion.transforms["rod"], stroke.points).mean(axis=1)
        there = np.column_stack([run["rod.x"], run["rod.y"]])[FRAMES]
        np.testing.assert_allclose(middle, there, rtol=0.0, atol=1e-15)


def test_the_rail_holds_the_block_in_every_frame(motion):
    blocks = [stroke for stroke in motion.strokes if stroke.kind == "area" and stroke.layer == 1.5]
    reach = moved(motion.transforms["ram"], blocks[0].points)[..., 0]
    rails = [
        stroke.points[:, 0]
        for stroke in motion.strokes
        if stroke.owner == "ground" and len(stroke.points) == 2
    ]
    low, high = min(map(np.min, rails)), max(rail.max() for rail in rails if rail.max() < 0.3)
    assert low < reach.min() and reach.max() < high


def test_the_arrow_is_that_of_the_contact(run):
    eccentricity, contact = journal_of(run, "wrist", np.arange(len(run.t)))
    force = np.hypot(run["wrist.normal_force"], run["wrist.friction_force"])
    np.testing.assert_allclose(np.hypot(*contact.T), force, rtol=1e-12)
    pressed = run["wrist.normal_force"] > 0.0
    # The normal force pushes the journal back inside.
    assert np.all(np.sum(contact * eccentricity, axis=1)[pressed] < 0.0)
    path = GAP * eccentricity / 5e-5
    tails, tips, full = arrows(path, contact)
    ways, lengths = tips - tails, np.hypot(*(tips - tails).T)
    np.testing.assert_allclose(np.hypot(*(tips - path).T)[pressed], 1.0)  # on the surface of the journal
    np.testing.assert_allclose(lengths, np.minimum(1.0, force / full), rtol=1e-9, atol=1e-12)
    toward = contact[pressed] / force[pressed, None]
    np.testing.assert_allclose(ways[pressed] / lengths[pressed, None], toward, rtol=1e-9, atol=1e-9)
    assert np.array_equal(tails[~pressed], tips[~pressed])


def film_of(page):
    return json.loads(re.search(r'<script type="application/json">(.*?)</script>', page)[1])


def test_the_page_needs_no_network_and_holds_the_motion(run, tmp_path):
    animation = cc.animate(run, "ram.vx", frames=7)
    assert (len(animation), repr(animation)) == (7, "<Animation: 7 frames, 25 a second>")
    text = animation.save(tmp_path / "press.html").read_text(encoding="utf-8")
    outside = text.replace("http://www.w3.org/2000/svg", "")  # the name of a language, not an address
    assert not re.search(r"https?:|url\(|@import|src=\"(?!data:)|href=\"(?!data:)", outside)
    assert (
        "default-src 'none'" in html.unescape(text) and '<html lang="en">' in text and text.count("<h1>") == 1
    )
    script = re.search(r"<script>(.*?)</script>", text, re.DOTALL)[1]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in html.unescape(text)
    film = film_of(text)
    mechanism, bearing = film["panels"]
    assert len(film["places"]) == 7 and film["places"][-1] == "t = 100 ms"
    assert all(len(steps) in (1, 7) for panel in film["panels"] for steps in panel["transforms"])
    # The ram slides in the drawing as it does in the run, and the journal within the magnified clearance.
    frames = np.linspace(0, 800, 7).round().astype(int)
    moves = {shape["name"]: shape["moves"] for shape in mechanism["shapes"]}
    shift = np.array(mechanism["transforms"][moves["ram"]])[:, 4]
    np.testing.assert_allclose(shift, run["ram.x"][frames] - run["ram.x"][0], rtol=1e-5, atol=1e-12)
    path = np.array(bearing["transforms"][1])[:, 4:]
    np.testing.assert_allclose(np.hypot(*path.T), GAP * run["wrist.eccentricity"][frames] / 5e-5, rtol=1e-4)
    # The arrow of the contact force, from its tail to its tip.
    steps, (_, force) = np.array(bearing["transforms"][2]), journal_of(run, "wrist", frames)
    tails, tips, _ = arrows(path, force)
    np.testing.assert_allclose(steps[:, 4:], tails, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(steps[:, :2], tips - tails, rtol=1e-4, atol=1e-6)
    (chart,) = film["charts"]
    assert chart["unit"] == "m/s" and chart["name"] == "ram.vx"
    np.testing.assert_allclose(chart["nominal"], run["ram.vx"], rtol=1e-5, atol=1e-12)


def test_a_gif_has_all_frames(run, tmp_path):
    animation = cc.animate(run, frames=5, rate=10, size=(6.0, 3.0))
    file = animation.save(tmp_path / "press.gif")
    with Image.open(file) as picture:
        assert (picture.format, picture.n_frames, picture.size) == ("GIF", 5, (600, 300))
        assert picture.info["duration"] == 100 and picture.info["loop"] == 0
        first = np.asarray(picture.convert("RGB")).astype(int)
        picture.seek(3)
        assert np.abs(np.asarray(picture.convert("RGB")).astype(int) - first).max() > 100
    # In a notebook the page plays in a frame of its own, whose scripts cannot reach the notebook.
    shown = animation._repr_html_()
    assert shown.startswith('<iframe title="Mechanism of crank, rod, ram"') and "<script" not in shown
    assert 'sandbox="allow-scripts allow-downloads"' in shown


@pytest.mark.parametrize("suffix", [".html", ".gif"])
def test_an_interrupted_save_leaves_the_old_file(run, tmp_path, monkeypatch, suffix):
    animation, path = cc.animate(run, frames=3, size=(3.0, 2.0)), tmp_path / f"press{suffix}"
    path.write_text("old")

    def interrupt(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "film_page", interrupt)
    monkeypatch.setattr(Image.Image, "save", interrupt)
    with pytest.raises(KeyboardInterrupt):
        animation.save(path)
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_still_shows_its_instant(run):
    figure = cc.animate(run, "ram.vx", frames=5).figure(-1)
    words = {text.get_text() for ax in figure.axes for text in ax.texts}
    assert "t = 100 ms" in words
    plot = figure.axes[2]
    np.testing.assert_array_equal(plot.lines[1].get_ydata(), run["ram.vx"])
    assert plot.get_ylabel().replace("\n", " ") == "x velocity of ram [m/s]"
    title = figure.axes[1].get_title().replace("\n", " ")
    assert title.startswith("wrist, clearance drawn 70 times larger")


def test_without_clearance_there_is_nothing_to_magnify(tmp_path):
    scene = cc.mechanisms.four_bar(clearance_at=())
    run = cc.simulate(scene, duration=scene.period, samples=101)
    animation = cc.animate(run, frames=4)
    assert len(animation.figure().axes) == 2
    film = film_of(animation.save(tmp_path / "bar.html").read_text(encoding="utf-8"))
    assert len(film["panels"]) == 1


def test_what_is_wrong_is_said(run, tmp_path):
    with pytest.raises(cc.errors.ArgumentError):
        cc.animate(run, frames=3).save(tmp_path / "press.avi")
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.animate(run.scene)
    with refuses("frames", "exaggerate", "joint"):
        cc.animate(run, joint="wirst", frames=1, exaggerate=0.5)
    with refuses("run"):
        cc.animate(run, "spring.force")
    short = cc.simulate(press(), duration=0.01, samples=11, outputs=["wrist.*", "ram.*"])
    with pytest.raises(cc.errors.ArgumentError):
        cc.animate(short)


def test_an_mp4_needs_ffmpeg(run, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(RuntimeError):
        cc.animate(run, frames=3).save(tmp_path / "press.mp4")


def test_an_mp4_is_one(run, tmp_path):
    try:
        module._ffmpeg()
    except RuntimeError as error:
        pytest.skip(str(error))
    file = cc.animate(run, frames=3, size=(4.0, 2.0)).save(tmp_path / "press.mp4")
    assert file.read_bytes()[4:8] == b"ftyp"


def test_a_run_that_ended_early_is_shown_until_then():
    run = cc.simulate(
        cc.mechanisms.slider_crank(), duration=0.06, samples=601, max_steps=500, on_failure="return"
    )
    animation = cc.animate(run, frames=10)
    assert animation.figure(-1) is not None
    assert animation.film().at[-1] <= 1e6 * run.end_time and "µs" in animation.film().label
