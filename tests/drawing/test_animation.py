"""Animations read back from their files: pins where the solver has them, paths that grow, frames, repetition."""

import re
import subprocess
import sys
from dataclasses import replace
from io import BytesIO
from math import pi

import numpy as np
import pytest

import planar
from planar.drawing.output.animation import PIXELS_PER_MM, animate, plan_animation
from planar.drawing.paper.pens import PEN_STYLES
from planar.drawing.paper.picture import Pen
from planar.drawing.scheme.symbol_table import PIN_RADIUS
from planar.foundation.errors import BadInput

pytest.importorskip("matplotlib")
from PIL import Image

TRACE = np.array([int(PEN_STYLES[Pen.PATH].colour[k : k + 2], 16) for k in (1, 3, 5)])


def read(content):
    """Every frame of a GIF (frames, height, width, 3)."""
    image = Image.open(BytesIO(content))
    frames = []
    for index in range(image.n_frames):
        image.seek(index)
        frames.append(np.asarray(image.convert("RGB")).astype(int))
    return np.array(frames)


def about(frame, at):
    """The darkest of a frame's pixels next to a place."""
    x, y = (int(part) for part in at)
    return frame[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].sum(axis=2).min() / 3.0


def is_pin(frame, at):
    """White in the middle, black around at a pin's radius."""
    x, y = at
    radius = PIN_RADIUS * PIXELS_PER_MM
    ring = [about(frame, (x + radius * np.cos(turn), y + radius * np.sin(turn))) for turn in np.arange(8) * pi / 4.0]
    return frame[int(y), int(x)].min() > 225 and max(ring) < 110


def traced(frame):
    """How many pixels a frame has in the full colour of paths."""
    return int((np.abs(frame - TRACE).max(axis=2) < 40).sum())


@pytest.fixture(scope="module")
def rocking():
    mechanism = planar.load("four-bar")
    return mechanism, plan_animation(mechanism, ["E"], 40), read(animate(mechanism, "gif", ["E"], frames=40))


def test_pins_are_where_the_solver_has_them_in_every_frame(rocking):
    mechanism, script, frames = rocking
    motion = planar.cycle(mechanism, 360)
    for index in range(0, 40, 3):
        k = index if index <= 20 else 40 - index
        for name in "ABCD":
            assert is_pin(frames[index], script.to_pixel(motion.point(name).position[18 * k])), (index, name)


def test_a_rocking_input_goes_there_and_back(rocking):
    _, script, frames = rocking
    assert len(frames) == 40
    assert script.rows[:21] == tuple(range(0, 361, 18))
    assert script.rows[21:] == script.rows[19:0:-1]


def test_the_traced_path_grows_there_and_stays_on_the_way_back(rocking):
    _, script, frames = rocking
    lengths = [traced(frame) for frame in frames]
    assert lengths[0] < 20 < lengths[5] < lengths[10] < lengths[15] < lengths[20]
    assert min(lengths[20:]) > 0.8 * lengths[20]  # links that pass over the path hide little of it
    assert script.traced[20:] == (360,) * 20


def test_what_stands_still_stays_as_it_is(rocking):
    _, script, frames = rocking
    x, y = script.to_pixel(planar.solve(rocking[0]).point("D").position)
    base = frames[:, int(y + 4.2 * PIXELS_PER_MM) - 1 : int(y + 5.5 * PIXELS_PER_MM), int(x) - 8 : int(x) + 8]
    assert base.min() < 60
    assert (base == base[0]).all()
    assert (frames[:, 0, 0] == 255).all()


def test_a_gif_repeats_for_ever_at_the_speed_asked_for():
    image = Image.open(BytesIO(animate(planar.load("004-SC12"), ".GIF", frames=12, fps=20)))
    assert image.n_frames == 12
    assert image.info["loop"] == 0
    assert image.info["duration"] == 50
    assert image.width % 2 == 0
    assert image.height % 2 == 0


def test_a_whole_turn_is_divided_equally_from_the_top_dead_centre():
    mechanism = planar.load("004-SC12")
    script = plan_animation(mechanism, ["D"], 12)
    frames = read(animate(mechanism, ".gif", ["D"], frames=12))
    assert len(frames) == 12
    for k, frame in enumerate(frames):
        turn = k * pi / 6.0
        crank = 0.03 * np.array([np.cos(turn), np.sin(turn)])
        piston = crank[0] + np.sqrt(0.1**2 - crank[1] ** 2), 0.0
        assert is_pin(frame, script.to_pixel(crank))
        assert is_pin(frame, script.to_pixel(piston))


def test_geared_links_go_on_until_they_are_back():
    script = plan_animation(planar.load("geared-five-bar"), ["P"], 20)
    assert len(script.rows) == 40
    assert script.run.input_travel[-1] == pytest.approx(4.0 * pi)


def test_the_corners_hold_every_position():
    for model in ("jansen-leg", "planetary-gear-set", "oldham", "002-E3.4"):
        script = plan_animation(planar.load(model), frames=24)
        for name in script.run.motion.point_names:
            spots = script.run.point(name).position / script.scale.per_mm
            assert (spots >= script.low).all()
            assert (spots <= script.high).all()


def test_a_hundred_frames_of_a_four_bar_are_small_and_always_the_same():
    content = animate(planar.load("four-bar"))
    assert len(content) < 1.5e6
    assert Image.open(BytesIO(content)).n_frames == 100
    small = [animate(planar.load("four-bar"), frames=6) for _ in range(2)]
    assert small[0] == small[1]


def test_progress_is_told_frame_by_frame():
    told = []
    animate(planar.load("004-SC12"), frames=5, progress=lambda done, total: told.append((done, total)))
    assert told == [(k, 5) for k in range(1, 6)]


def test_one_of_several_inputs_runs():
    motion = planar.cycle(planar.load("excavator-arm"), 24, pair="bucket cylinder")
    script = plan_animation(motion, ["tip"], 12)
    frames = read(animate(motion, "gif", ["tip"], frames=12))
    for index in (2, 5):
        at = script.run.point("H").position[script.rows[index]]
        assert is_pin(frames[index], script.to_pixel(at))


def test_an_mp4_has_every_frame_with_its_pins():
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    mechanism = planar.load("four-bar")
    script = plan_animation(mechanism, ["E"], 16)
    film = animate(mechanism, ".mp4", ["E"], frames=16)
    command = [ffmpeg, "-i", "pipe:0", "-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"]
    done = subprocess.run(command, input=film, capture_output=True, check=True)
    width, height = script.size
    assert f"{width}x{height}" in done.stderr.decode()
    assert "25 fps" in done.stderr.decode()
    frames = np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3).astype(int)
    assert len(frames) == 16
    for index in (0, 3, 8, 13):
        for name in "ABCD":
            assert is_pin(frames[index], script.to_pixel(script.run.point(name).position[script.rows[index]]))


def test_an_mp4_that_is_broken_off_leaves_nothing_behind():
    pytest.importorskip("imageio_ffmpeg")

    def stop(done, total):
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        animate(planar.load("four-bar"), "mp4", frames=100, progress=stop)


def test_an_mp4_without_ffmpeg_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(
        BadInput, match=re.escape('imageio-ffmpeg: MP4 files need ffmpeg: pip install "planar-linkages[video]"')
    ):
        animate(planar.load("four-bar"), ".mp4")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            {"suffix": ".avi"},
            "a file name that ends in '.avi': an animation can be written to files that end in .gif or .mp4",
        ),
        ({"fps": 0.0}, "1 to 50 frames a second are wanted, not 0.0"),
        ({"fps": float("nan")}, "1 to 50 frames a second are wanted"),
        ({"frames": 1}, "2 to 1000 frames are wanted, not 1"),
        ({"frames": 10.5}, "2 to 1000 frames are wanted"),
        ({"paths": ["Z"]}, "there is no point 'Z'; points are"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_a_sentence(arguments, sentence):
    with pytest.raises(BadInput, match=re.escape(sentence)):
        animate(planar.load("four-bar"), **arguments)


@pytest.mark.filterwarnings("ignore::planar.foundation.errors.MissingGlyphs")
def test_hostile_names_do_no_harm():
    mechanism = planar.load("004-SC12")
    pair = replace(mechanism.pairs[0], name="$x_{机", pin="$x_{机")
    given = mechanism.inputs[0]._replace(pair="$x_{机")
    hostile = replace(mechanism, pairs=(pair, *mechanism.pairs[1:]), inputs=(given,))
    assert len(read(animate(hostile, frames=3))) == 3


def test_without_matplotlib_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(BadInput, match=re.escape('pip install "planar-linkages[plot]"')):
        animate(planar.load("four-bar"))
