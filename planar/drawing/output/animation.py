"""A mechanism in motion as a GIF or an MP4: frames at exact positions, with the paths of points growing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from io import BytesIO
from math import ceil, cos, pi, radians, sin
from numbers import Integral, Real
from subprocess import DEVNULL, PIPE, Popen
from threading import Thread
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planar.drawing.diagrams.drawn_run import Run, closing, smooth, steady
from planar.drawing.diagrams.positions import chosen_points, coupler_points
from planar.drawing.labels.fonts import families, shown
from planar.drawing.paper.pens import FILLS, INK, ready
from planar.drawing.paper.picture import Circle, Fill, Line, Mark, Pen, Spot, extent
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme.link_bodies import bodies
from planar.drawing.scheme.scheme import body_marks, ground_marks
from planar.foundation.errors import BadInput, no_format
from planar.model.mechanism import Mechanism
from planar.model.wording import amount
from planar.results.motion import Motion

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = np.ndarray
Progress = Callable[[int, int], None]
"""Told how many frames are done, and of how many."""

ROOM = 130.0, 95.0
"""mm that the motion takes; symbols have the sizes that they have on paper."""
EDGE, FOOT = 4.0, 6.0
"""mm about it, and below it for the line of text."""
PIXELS = 4.0
"""to a mm"""
DPI = 100.0
FRAMES, MOST_FRAMES = 100, 1000
"""Frames of one turn, or there and back; and of an animation at the most."""
FINE = 360
"""Positions, at least, of a traced path."""
FASTEST = 50.0
"""Frames a second: viewers show a GIF no faster."""
COLOURS = 64
FAINT = 0.25
"""How much of its colour a path has before it is traced."""
ROUND = 48
"""Corners of a circle."""
SUFFIXES = (".gif", ".mp4")


class Script(NamedTuple):
    """What is drawn: the run, its scale, the rows of the frames in the order shown, and how far paths have come."""

    run: Run
    scale: Scale
    rows: tuple[int, ...]
    traced: tuple[int, ...]
    "the last row up to which a path is drawn in each frame"
    paths: tuple[str, ...]
    low: Spot
    high: Spot
    "corners of the drawing (mm)"
    ground: tuple[Mark, ...]
    bodies: tuple[tuple[Mark, ...], ...]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels, both even."""
        width, height = (2 * ceil((b - a) * PIXELS / 2.0) for a, b in zip(self.low, self.high, strict=True))
        return width, height

    def pixel(self, at: Iterable[float]) -> tuple[float, float]:
        """Where a place (m) is in a frame: pixels from its left and from its top."""
        x, y = (float(part) / self.scale.per_mm for part in at)
        return (x - self.low[0]) * PIXELS, self.size[1] - (y - self.low[1]) * PIXELS


def animate(
    motion: Motion | Mechanism,
    suffix: str = ".gif",
    paths: Iterable[str] | None = None,
    progress: Progress | None = None,
    fps: float = 25.0,
    frames: int = FRAMES,
) -> bytes:
    """The motion as the bytes of a GIF that repeats for ever, or of an MP4.

    A whole turn is shown once, from the top dead centre where there is one, in `frames` equal divisions, and on until a
    geared mechanism is back; a rocking input goes there and back; a motion in time is shown once. `paths` names the
    points whose paths grow (left out: those of `loci`). Raises BadInput for names, numbers and suffixes that cannot be
    meant, or where a library is missing; NoAnswer without a motion.
    """
    kind = f".{str(suffix).lower().lstrip('.')}"
    if kind not in SUFFIXES:
        raise no_format(str(suffix), "an animation", SUFFIXES)
    if isinstance(fps, bool) or not isinstance(fps, Real) or not 1.0 <= fps <= FASTEST:
        raise BadInput("fps", f"1 to {FASTEST:g} frames a second are wanted, not {fps!r:.40}")
    ready()
    program = _ffmpeg() if kind == ".mp4" else None
    script = scripted(motion, paths, frames)
    if program is None:
        return _gif(script, float(fps), progress or _quietly)
    return _mp4(script, float(fps), progress or _quietly, program)


def _quietly(done: int, total: int) -> None:
    """Tell nobody."""


def scripted(motion: Motion | Mechanism, paths: Iterable[str] | None = None, frames: int = FRAMES) -> Script:
    """What an animation shows, before anything is drawn."""
    if isinstance(frames, bool) or not isinstance(frames, Integral) or not 2 <= frames <= MOST_FRAMES:
        raise BadInput("frames", f"2 to {MOST_FRAMES} frames are wanted, not {frames!r:.40}")
    whole_steps = int(frames)
    steps = whole_steps * ceil(FINE / whole_steps)
    run = closing(steady(motion, steps=steps, count=whole_steps))
    last = len(run.motion) - 1
    if run.whole:
        stride = max(last // (whole_steps * run.turns), ceil(last / MOST_FRAMES))
        rows = list(range(0, last, stride))
        traced = rows
    elif run.in_time:
        rows = traced = [round(last * k / (whole_steps - 1)) for k in range(whole_steps)]
    else:
        half = max(whole_steps // 2, 1)
        there = [round(last * k / half) for k in range(half + 1)]
        rows, traced = there + there[-2:0:-1], there + [last] * (half - 1)
    names = chosen_points(run, paths) if paths is not None else coupler_points(run)
    return _script(run, rows, traced, names)


def _script(run: Run, rows: Sequence[int], traced: Sequence[int], names: tuple[str, ...]) -> Script:
    mechanism, shapes = run.motion.mechanism, run.motion.shapes
    low, high = run.bounds
    width, height = (float(part) for part in high - low)
    scale = Scale("length", max(width / ROOM[0], height / ROOM[1]) or 1e-3, mechanism.units.length)
    made, travel = bodies(mechanism, shapes), run.travel
    ground = ground_marks(mechanism, made, run.frames(rows[0]), shapes, scale, travel)
    moving = tuple(body_marks(mechanism, made, run.frames(row), shapes, scale, travel=travel) for row in rows)
    corners = [extent(marks) for marks in (ground, *moving) if marks]
    corners += [(tuple(low / scale.per_mm), tuple(high / scale.per_mm))]
    lowest = np.min([corner for corner, _ in corners], axis=0) - EDGE
    highest = np.max([corner for _, corner in corners], axis=0) + EDGE
    lowest = lowest - (0.0, FOOT)
    return Script(
        run,
        scale,
        tuple(rows),
        tuple(traced),
        names,
        (float(lowest[0]), float(lowest[1])),
        (float(highest[0]), float(highest[1])),
        ground,
        moving,
    )


class _Stage:
    """A figure whose background is drawn once, and artists that are moved from frame to frame."""

    def __init__(self, script: Script):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.script = script
        width, height = script.size
        self.figure: Figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
        self.canvas = FigureCanvasAgg(self.figure)
        self.axes: Axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self.axes.set_axis_off()
        self.axes.set_xlim(script.low[0], script.low[0] + width / PIXELS)
        self.axes.set_ylim(script.low[1], script.low[1] + height / PIXELS)
        run, per_mm = script.run, script.scale.per_mm
        self.points = [run.point(name) for name in script.paths]
        for name in script.paths:
            line = _artist(self.axes, Line(tuple(map(tuple, run.path(name) / per_mm)), Pen.PATH))
            line.set_alpha(FAINT)
        for mark in script.ground:
            _artist(self.axes, mark)
        self.canvas.draw()
        self.background = self.canvas.copy_from_bbox(self.figure.bbox)
        self.traces = [_artist(self.axes, Line(((0.0, 0.0),), Pen.PATH)) for _ in script.paths]
        self.casts: dict[tuple[Any, ...], list[Artist]] = {}
        units = run.motion.mechanism.units
        self.kind, self.units = ("length" if run.slides else "angle"), units
        family = list(families(shown(run.given.pair)))
        self.text = self.axes.text(
            script.low[0] + EDGE, script.low[1] + 2.0, "", family=family, fontsize=9.0, va="bottom", parse_math=False
        )

    def shot(self, index: int) -> Array:
        """One frame (height, width, 3) of bytes."""
        script = self.script
        self.canvas.restore_region(self.background)
        gone = script.traced[index] + 1
        for trace, point in zip(self.traces, self.points, strict=True):
            path = smooth(point.position[:gone], point.velocity[:gone])
            trace.set_data(*path.T / script.scale.per_mm)
            self.axes.draw_artist(trace)
        for mark, artist in zip(script.bodies[index], self._cast(script.bodies[index]), strict=True):
            _moved(artist, mark)
            self.axes.draw_artist(artist)
        self.text.set_text(self._told(index))
        self.axes.draw_artist(self.text)
        return np.asarray(self.canvas.buffer_rgba())[:, :, :3].copy()

    def _cast(self, marks: Sequence[Mark]) -> list[Artist]:
        """The artists for such marks; other ones only where a position has other strokes."""
        key = tuple((type(mark), mark.pen, getattr(mark, "closed", True), mark.fill) for mark in marks)
        if key not in self.casts:
            self.casts[key] = [_artist(self.axes, mark) for mark in marks]
        return self.casts[key]

    def _told(self, index: int) -> str:
        """Where the input is, and when: time goes on while it goes back."""
        run, rows = self.script.run, self.script.rows
        position = float(run.position[rows[index]])
        if run.whole:
            position %= 2.0 * pi
        told = shown(f"{run.given.pair} = {_amount(position, self.kind, self.units)}")
        time = float(np.abs(np.diff(run.time[list(rows[: index + 1])])).sum())
        return f"{told}    t = {time:.3g} s" if run.timed else told


def _amount(value: float, kind: str, units: Any) -> str:
    """To a tenth of a unit, so that the text does not flicker."""
    number, _, name = amount(value, kind, units).partition(" ")
    return f"{float(number):.1f} {name}"


def _corners(mark: Line | Circle) -> Array:
    """The places that a stroke goes through (n, 2)."""
    if isinstance(mark, Line):
        return np.array(mark.spots)
    (x, y), r = mark.centre, mark.radius
    turns = [radians(mark.start + (mark.stop - mark.start) * k / ROUND) for k in range(ROUND + 1)]
    return np.array([(x + r * cos(turn), y + r * sin(turn)) for turn in turns])


def _artist(axes: Axes, mark: Mark) -> Any:
    """The stroke of a mark, as wide as on paper."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Polygon

    ink = INK[mark.pen]
    points = ink.width * PIXELS * 72.0 / DPI
    dashes = (0.0, tuple(each / ink.width for each in ink.dashes)) if ink.dashes else "-"
    corners = _corners(mark)
    if mark.fill is not Fill.NONE:
        area = Polygon(corners, closed=True, fc=FILLS[mark.fill], ec=ink.colour, lw=points, joinstyle="round")
        return axes.add_patch(area)
    if isinstance(mark, Line) and mark.closed:
        corners = np.vstack([corners, corners[:1]])
    line = Line2D(*corners.T, color=ink.colour, lw=points, ls=dashes, solid_capstyle="round", solid_joinstyle="round")
    return axes.add_line(line)


def _moved(artist: Any, mark: Mark) -> None:
    corners = _corners(mark)
    if hasattr(artist, "set_xy"):
        artist.set_xy(corners)
    else:
        closed = isinstance(mark, Line) and mark.closed
        artist.set_data(*(np.vstack([corners, corners[:1]]) if closed else corners).T)


def _shots(script: Script, progress: Progress) -> Iterator[Array]:
    stage, total = _Stage(script), len(script.rows)
    for index in range(total):
        yield stage.shot(index)
        progress(index + 1, total)


def _gif(script: Script, fps: float, progress: Progress) -> bytes:
    """All frames in the colours that the one with most of each path has most of, so that nothing flickers."""
    from PIL import Image

    colours = _palette(_Stage(script).shot(int(np.argmax(script.traced))))
    nearest = _nearest(colours)

    def image(shot: Array) -> Image.Image:
        cells = (shot >> 3).astype(np.uint16)
        made = Image.fromarray(nearest[cells[..., 0] << 10 | cells[..., 1] << 5 | cells[..., 2]])
        made.putpalette(colours.tobytes())
        return made

    images = [image(shot) for shot in _shots(script, progress)]
    content = BytesIO()
    images[0].save(
        content,
        "GIF",
        save_all=True,
        append_images=images[1:],
        loop=0,
        duration=10 * round(100.0 / fps),
        disposal=1,
        optimize=False,
    )
    return content.getvalue()


def _palette(shot: Array) -> Array:
    """The most frequent colours of a frame (n, 3), as bytes."""
    colours, counts = np.unique(shot.reshape(-1, 3), axis=0, return_counts=True)
    return colours[np.argsort(-counts, kind="stable")[:COLOURS]]


def _nearest(colours: Array) -> Array:
    """For every colour of five bits to a channel the nearest of a palette; black and white are themselves."""
    steps = np.arange(32) * 255.0 / 31.0
    cells = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    palette = colours.astype(float)
    # |c - p|^2 less |c|^2, which is the same for all p
    return np.argmin((palette**2).sum(axis=1) - 2.0 * cells @ palette.T, axis=1).astype(np.uint8)


def _ffmpeg() -> str:
    """The program that writes MP4 files. Raises BadInput where it is not there."""
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        raise BadInput("imageio-ffmpeg", "MP4 files need ffmpeg: pip install 'planar[video]'") from None


def _mp4(script: Script, fps: float, progress: Progress, ffmpeg: str) -> bytes:
    """H.264 in fragments, which can be written to a pipe."""
    width, height = script.size
    given = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "pipe:0"]
    wanted = ["-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-threads", "2"]
    fragments = ["-movflags", "frag_keyframe+empty_moov+default_base_moof", "-f", "mp4", "pipe:1"]
    command = [ffmpeg, "-v", "error", *given, *wanted, *fragments]
    found: list[bytes] = []
    with Popen(command, stdin=PIPE, stdout=PIPE, stderr=DEVNULL) as process:
        written, wanted_by = process.stdin, process.stdout
        assert written is not None and wanted_by is not None
        reading = Thread(target=lambda: found.append(wanted_by.read()))
        reading.start()
        try:
            with suppress(BrokenPipeError), written:
                for shot in _shots(script, progress):
                    written.write(shot.tobytes())
        except BaseException:
            process.kill()  # or it would wait for the rest
            raise
        finally:
            reading.join()
    if process.returncode or not found[0]:
        raise BadInput("imageio-ffmpeg", "ffmpeg could not write the MP4 file")
    return found[0]
