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
import numpy.typing as npt

from planar.drawing.diagrams.drawn_run import DrawnRun, closed_run, smooth_path, steady_run
from planar.drawing.diagrams.positions import coupler_points, resolve_points
from planar.drawing.labels.fonts import font_families, printable_text
from planar.drawing.paper.pens import FILL_COLOURS, pen_style, require_matplotlib
from planar.drawing.paper.picture import Fill, Outline, PaperPoint, Pen, Polyline, extent
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme.ground import ground_marks
from planar.drawing.scheme.link_bodies import link_bodies
from planar.drawing.scheme.link_strokes import body_marks
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, unknown_format_error
from planar.foundation.time_limit import all_within_time
from planar.model.mechanism import Mechanism
from planar.model.wording import amount
from planar.results.motion import Motion

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Pixels = npt.NDArray[np.uint8]
"""Bytes of a picture, or of colours."""

Progress = Callable[[int, int], None]
"""Told how many frames are done, and of how many."""

MOTION_SIZE = 130.0, 95.0
"""mm that the motion takes; symbols have the sizes that they have on paper."""
MARGIN, CAPTION_HEIGHT = 4.0, 6.0
"""mm about it, and below it for the line of text."""
PIXELS_PER_MM = 4.0
"""to a mm"""
DPI = 100.0
DEFAULT_FRAMES, MAX_FRAMES = 100, 1000
"""Frames of one turn, or there and back; and of an animation at the most."""
MIN_PATH_STEPS = 360
"""Positions, at least, of a traced path."""
MAX_FPS = 50.0
"""Frames a second: viewers show a GIF no faster."""
PALETTE_SIZE = 64
FAINT_ALPHA = 0.25
"""How much of its colour a path has before it is traced."""
CIRCLE_CORNERS = 48
"""Corners of a circle."""
SUFFIXES = (".gif", ".mp4")


class AnimationScript(NamedTuple):
    """What is drawn: the run, its scale, the rows of the frames in the order shown, and how far paths have come."""

    run: DrawnRun
    scale: Scale
    rows: tuple[int, ...]
    traced: tuple[int, ...]
    "the last row up to which a path is drawn in each frame"
    paths: tuple[str, ...]
    low: PaperPoint
    high: PaperPoint
    "corners of the drawing (mm)"
    ground: tuple[Outline, ...]
    bodies: tuple[tuple[Outline, ...], ...]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels, both even."""
        width, height = (2 * ceil((b - a) * PIXELS_PER_MM / 2.0) for a, b in zip(self.low, self.high, strict=True))
        return width, height

    def to_pixel(self, at: Iterable[float]) -> tuple[float, float]:
        """Where a place (m) is in a frame: pixels from its left and from its top."""
        x, y = (float(part) / self.scale.per_mm for part in at)
        return (x - self.low[0]) * PIXELS_PER_MM, self.size[1] - (y - self.low[1]) * PIXELS_PER_MM


def animate(
    motion: Motion | Mechanism,
    suffix: str = ".gif",
    paths: Iterable[str] | None = None,
    progress: Progress | None = None,
    fps: float = 25.0,
    frames: int = DEFAULT_FRAMES,
) -> bytes:
    """The motion as the bytes of a GIF that repeats for ever, or of an MP4.

    A whole turn is shown once, from the top dead centre where there is one, in `frames` equal divisions, and on until a
    geared mechanism is back; a rocking input goes there and back; a motion in time is shown once. `paths` names the
    points whose paths grow (left out: those of `loci`). Raises BadInput for names, numbers and suffixes that cannot be
    meant, or where a library is missing; NoAnswer without a motion.
    """
    kind = f".{str(suffix).lower().lstrip('.')}"
    if kind not in SUFFIXES:
        raise unknown_format_error(str(suffix), "an animation", SUFFIXES)
    if isinstance(fps, bool) or not isinstance(fps, Real) or not 1.0 <= fps <= MAX_FPS:
        raise BadInput("fps", f"1 to {MAX_FPS:g} frames a second are wanted, not {fps!r:.40}")
    require_matplotlib()
    program = _find_ffmpeg() if kind == ".mp4" else None
    script = plan_animation(motion, paths, frames)
    if program is None:
        return _encode_gif(script, float(fps), progress or _ignore_progress)
    return _encode_mp4(script, float(fps), progress or _ignore_progress, program)


def _ignore_progress(done: int, total: int) -> None:
    """Tell nobody."""


def plan_animation(
    motion: Motion | Mechanism, paths: Iterable[str] | None = None, frames: int = DEFAULT_FRAMES
) -> AnimationScript:
    """What an animation shows, before anything is drawn."""
    if isinstance(frames, bool) or not isinstance(frames, Integral) or not 2 <= frames <= MAX_FRAMES:
        raise BadInput("frames", f"2 to {MAX_FRAMES} frames are wanted, not {frames!r:.40}")
    whole_steps = int(frames)
    steps = whole_steps * ceil(MIN_PATH_STEPS / whole_steps)
    run = closed_run(steady_run(motion, steps=steps, count=whole_steps))
    last = len(run.motion) - 1
    if run.makes_whole_turns:
        stride = max(last // (whole_steps * run.turns), ceil(last / MAX_FRAMES))
        rows = list(range(0, last, stride))
        traced = rows
    elif run.is_time_run:
        rows = traced = [round(last * k / (whole_steps - 1)) for k in range(whole_steps)]
    else:
        half = max(whole_steps // 2, 1)
        there = [round(last * k / half) for k in range(half + 1)]
        rows, traced = there + there[-2:0:-1], there + [last] * (half - 1)
    names = resolve_points(run, paths) if paths is not None else coupler_points(run)
    return _build_script(run, rows, traced, names)


def _build_script(run: DrawnRun, rows: Sequence[int], traced: Sequence[int], names: tuple[str, ...]) -> AnimationScript:
    mechanism, shapes = run.motion.mechanism, run.motion.shapes
    low, high = run.bounds
    width, height = (float(part) for part in high - low)
    scale = Scale("length", max(width / MOTION_SIZE[0], height / MOTION_SIZE[1]) or 1e-3, mechanism.units.length)
    made, travel = link_bodies(mechanism, shapes), run.slide_ranges
    ground = ground_marks(mechanism, made, run.frames(rows[0]), shapes, scale, travel)
    moving = tuple(body_marks(mechanism, made, run.frames(row), shapes, scale, travel=travel) for row in rows)
    corners = [extent(marks) for marks in (ground, *moving) if marks]
    corners += [(tuple(low / scale.per_mm), tuple(high / scale.per_mm))]
    lowest = np.min([corner for corner, _ in corners], axis=0) - MARGIN
    highest = np.max([corner for _, corner in corners], axis=0) + MARGIN
    lowest = lowest - (0.0, CAPTION_HEIGHT)
    return AnimationScript(
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


class _FrameCanvas:
    """A figure whose background is drawn once, and artists that are moved from frame to frame."""

    def __init__(self, script: AnimationScript):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.script = script
        width, height = script.size
        self.figure: Figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
        self.canvas = FigureCanvasAgg(self.figure)
        self.axes: Axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self.axes.set_axis_off()
        self.axes.set_xlim(script.low[0], script.low[0] + width / PIXELS_PER_MM)
        self.axes.set_ylim(script.low[1], script.low[1] + height / PIXELS_PER_MM)
        run, per_mm = script.run, script.scale.per_mm
        self.points = [run.point(name) for name in script.paths]
        for name in script.paths:
            line = _add_artist(self.axes, Polyline(tuple(map(tuple, run.path(name) / per_mm)), Pen.PATH))
            line.set_alpha(FAINT_ALPHA)
        for mark in script.ground:
            _add_artist(self.axes, mark)
        self.canvas.draw()
        self.background = self.canvas.copy_from_bbox(self.figure.bbox)
        self.traces = [_add_artist(self.axes, Polyline(((0.0, 0.0),), Pen.PATH)) for _ in script.paths]
        self.artists_by_kind: dict[tuple[Any, ...], list[Artist]] = {}
        units = run.motion.mechanism.units
        self.kind, self.units = ("length" if run.is_sliding_input else "angle"), units
        family = list(font_families(printable_text(run.input.pair)))
        self.text = self.axes.text(
            script.low[0] + MARGIN, script.low[1] + 2.0, "", family=family, fontsize=9.0, va="bottom", parse_math=False
        )

    def draw_frame(self, index: int) -> Pixels:
        """One frame (height, width, 3) of bytes."""
        script = self.script
        self.canvas.restore_region(self.background)
        gone = script.traced[index] + 1
        for trace, point in zip(self.traces, self.points, strict=True):
            path = smooth_path(point.position[:gone], point.velocity[:gone])
            trace.set_data(*path.T / script.scale.per_mm)
            self.axes.draw_artist(trace)
        for mark, artist in zip(script.bodies[index], self._artists_for(script.bodies[index]), strict=True):
            _move_artist(artist, mark)
            self.axes.draw_artist(artist)
        self.text.set_text(self._frame_text(index))
        self.axes.draw_artist(self.text)
        return np.asarray(self.canvas.buffer_rgba())[:, :, :3].copy()

    def _artists_for(self, marks: Sequence[Outline]) -> list[Artist]:
        """The artists for such marks; other ones only where a position has other strokes."""
        key = tuple((type(mark), mark.pen, getattr(mark, "closed", True), mark.fill) for mark in marks)
        if key not in self.artists_by_kind:
            self.artists_by_kind[key] = [_add_artist(self.axes, mark) for mark in marks]
        return self.artists_by_kind[key]

    def _frame_text(self, index: int) -> str:
        """Where the input is, and when: time goes on while it goes back."""
        run, rows = self.script.run, self.script.rows
        position = float(run.position[rows[index]])
        if run.makes_whole_turns:
            position %= 2.0 * pi
        told = printable_text(f"{run.input.pair} = {_rounded_amount(position, self.kind, self.units)}")
        time = float(np.abs(np.diff(run.time[list(rows[: index + 1])])).sum())
        return f"{told}    t = {time:.3g} s" if run.has_speed else told


def _rounded_amount(value: float, kind: str, units: Any) -> str:
    """To a tenth of a unit, so that the text does not flicker."""
    number, _, name = amount(value, kind, units).partition(" ")
    return f"{float(number):.1f} {name}"


def _outline_points(mark: Outline) -> Array:
    """The places that a stroke goes through (n, 2)."""
    if isinstance(mark, Polyline):
        return np.array(mark.points)
    (x, y), r = mark.centre, mark.radius
    turns = [radians(mark.start + (mark.stop - mark.start) * k / CIRCLE_CORNERS) for k in range(CIRCLE_CORNERS + 1)]
    return np.array([(x + r * cos(turn), y + r * sin(turn)) for turn in turns])


def _add_artist(axes: Axes, mark: Outline) -> Any:
    """The stroke of a mark, as wide as on paper."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Polygon

    ink = pen_style(mark)
    points = ink.width * PIXELS_PER_MM * 72.0 / DPI
    dashes = (0.0, tuple(each / ink.width for each in ink.dashes)) if ink.dashes else "-"
    corners = _outline_points(mark)
    if mark.fill is not Fill.NONE:
        area = Polygon(corners, closed=True, fc=FILL_COLOURS[mark.fill], ec=ink.colour, lw=points, joinstyle="round")
        return axes.add_patch(area)
    if isinstance(mark, Polyline) and mark.closed:
        corners = np.vstack([corners, corners[:1]])
    line = Line2D(*corners.T, color=ink.colour, lw=points, ls=dashes, solid_capstyle="round", solid_joinstyle="round")
    return axes.add_line(line)


def _move_artist(artist: Any, mark: Outline) -> None:
    corners = _outline_points(mark)
    if hasattr(artist, "set_xy"):
        artist.set_xy(corners)
    else:
        closed = isinstance(mark, Polyline) and mark.closed
        artist.set_data(*(np.vstack([corners, corners[:1]]) if closed else corners).T)


def _rendered_frames(script: AnimationScript, progress: Progress) -> Iterator[Pixels]:
    stage, total = _FrameCanvas(script), len(script.rows)
    for index in all_within_time(range(total), "frames"):
        yield stage.draw_frame(index)
        progress(index + 1, total)


def _encode_gif(script: AnimationScript, fps: float, progress: Progress) -> bytes:
    """All frames in the colours that the one with most of each path has most of, so that nothing flickers."""
    from PIL import Image

    colours = _palette(_FrameCanvas(script).draw_frame(int(np.argmax(script.traced))))
    nearest = _nearest_colours(colours)

    def image(shot: Pixels) -> Image.Image:
        cells = (shot >> 3).astype(np.uint16)
        made = Image.fromarray(nearest[cells[..., 0] << 10 | cells[..., 1] << 5 | cells[..., 2]])
        made.putpalette(colours.tobytes())
        return made

    images = [image(shot) for shot in _rendered_frames(script, progress)]
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


def _palette(shot: Pixels) -> Pixels:
    """The most frequent colours of a frame (n, 3), as bytes."""
    # sorted as numbers of three bytes, in a tenth of the time that rows take
    packed = shot.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
    colours, counts = np.unique(packed, return_counts=True)
    frequent = colours[np.argsort(-counts, kind="stable")[:PALETTE_SIZE]]
    return (frequent[:, None] >> np.array([16, 8, 0]) & 0xFF).astype(np.uint8)


def _nearest_colours(colours: Pixels) -> Pixels:
    """For every colour of five bits to a channel the nearest of a palette; black and white are themselves."""
    steps = np.arange(32) * 255.0 / 31.0
    cells = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    palette = colours.astype(float)
    # |c - p|^2 less |c|^2, which is the same for all p
    return np.argmin((palette**2).sum(axis=1) - 2.0 * cells @ palette.T, axis=1).astype(np.uint8)


def _find_ffmpeg() -> str:
    """The program that writes MP4 files. Raises BadInput where it is not there."""
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        raise BadInput("imageio-ffmpeg", 'MP4 files need ffmpeg: pip install "planar-linkages[video]"') from None


def _encode_mp4(script: AnimationScript, fps: float, progress: Progress, ffmpeg: str) -> bytes:
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
                for shot in _rendered_frames(script, progress):
                    written.write(shot.tobytes())
        except BaseException:
            process.kill()  # or it would wait for the rest
            raise
        finally:
            reading.join()
    if process.returncode or not found[0]:
        raise BadInput("imageio-ffmpeg", "ffmpeg could not write the MP4 file")
    return found[0]
