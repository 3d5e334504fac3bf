"""Texts of a matplotlib figure, as they are seen."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text


def visible_texts(figure):
    """Every text that can be seen, with its box in pixels."""
    canvas = FigureCanvasAgg(figure)
    figure.draw_without_rendering()
    renderer = canvas.get_renderer()
    found = [text for text in figure.findobj(lambda each: hasattr(each, "get_text")) if text.get_visible()]
    return [(text.get_text(), text.get_window_extent(renderer)) for text in found if text.get_text().strip()]


def text_boxes(figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    shown = [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]
    return canvas.get_width_height(), [(text.get_text(), text.get_window_extent()) for text in shown]
