"""Drawings as DXF: on paper as long as their scale says, in millimetres, with letters and dashes of their own."""

from math import hypot

import ezdxf
import numpy as np
import pytest

import planar
from tests.command import run


def test_a_scheme_to_scale_has_its_links_as_long_as_on_paper(tmp_path):
    run(tmp_path, "plot", "four-bar", "scheme", "--scale", "1:2", "-o", "scheme.dxf").done()
    document = ezdxf.readfile(tmp_path / "scheme.dxf")
    assert document.units == ezdxf.units.MM and not document.audit().errors
    lines = [
        np.array([point[:2] for point in each]) for each in document.modelspace().query('LWPOLYLINE[layer=="LINES"]')
    ]
    lengths = [hypot(*(each[-1] - each[0])) for each in lines if len(each) == 2]
    for link in (50.0, 66.0, 56.0):
        assert min(abs(each - link / 2.0) for each in lengths) < 1e-6
    assert document.modelspace().query('LWPOLYLINE[layer=="TEXT"]')


def test_curves_are_cut_where_their_axes_end(tmp_path):
    figure = planar.plot.diagrams(planar.cycle("slider-crank", 36))
    planar.plot.save(figure, tmp_path / "d.dxf")
    document = ezdxf.readfile(tmp_path / "d.dxf")
    points = np.array([point[:2] for each in document.modelspace().query("LWPOLYLINE") for point in each])
    width, height = 25.4 * figure.get_size_inches()
    assert points.min() >= -1.0
    assert np.all(points.max(axis=0) <= (width + 1.0, height + 1.0))


def test_several_sheets_need_pages(tmp_path):
    with pytest.raises(planar.BadInput, match="sheets need pages"):
        planar.plot.save([planar.plot.scheme(planar.solve("four-bar"))] * 2, tmp_path / "two.dxf")
