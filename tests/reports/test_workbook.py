"""Runs as workbooks: numbers and units are those of the run, formulas over them, and no text is taken for one."""

import io
from dataclasses import replace

import numpy as np
import openpyxl
import pytest

import planar
from planar.foundation.errors import BadInput
from planar.reports.columns import run_columns
from planar.reports.files import workbook
from planar.reports.files.run_formats import encode_run
from tests.command import run


def sheets(content, values=True):
    book = openpyxl.load_workbook(io.BytesIO(content), data_only=values)
    return [[list(row) for row in book[name].iter_rows(values_only=True)] for name in ("run", "extremes")]


def test_every_number_stands_under_its_head_with_its_unit():
    motion = planar.cycle("slider-crank", steps=12)
    table, extremes = sheets(encode_run(motion, ".xlsx"))
    columns = tuple(run_columns(motion))
    assert table[0] == [column.head for column in columns]
    assert "pair stroke displacement [mm]" in table[0]
    for number, column in enumerate(columns):
        assert np.allclose([row[number] for row in table[1:]], column.values, rtol=1e-15)
    least = {row[0]: row[1:4] for row in extremes[1:] if row[0]}
    assert least["pair stroke displacement"] == pytest.approx(["mm", 1120.0, 2080.0])  # rod less and plus crank
    assert least["mechanism"][0] == "Slider-crank"


def test_extremes_are_formulas_over_the_run():
    content = encode_run(planar.cycle("four-bar", steps=6), ".xlsx")
    _, extremes = sheets(content, values=False)
    assert extremes[1][2:4] == ["=MIN(run!$A$2:$A$8)", "=MAX(run!$A$2:$A$8)"]


def test_what_is_not_determined_is_blank_and_a_text_is_no_formula():
    motion = planar.cycle("scissor-lift", steps=8)
    named = replace(motion, mechanism=replace(motion.mechanism, name='=cmd|"x"'))
    _, extremes = sheets(encode_run(named, ".xlsx"), values=False)
    book = openpyxl.load_workbook(io.BytesIO(encode_run(named, ".xlsx")))
    cell = next(row[1] for row in book["extremes"].iter_rows() if row[0].value == "mechanism")
    assert (cell.value, cell.data_type) == ('=cmd|"x"', "s") or cell.data_type in ("s", "inlineStr")
    assert extremes


def test_more_than_a_sheet_holds_is_refused(monkeypatch):
    monkeypatch.setattr(workbook, "MAX_ROWS", 10)
    with pytest.raises(BadInput, match=r"more than a sheet has; write .csv or .parquet"):
        encode_run(planar.cycle("four-bar", steps=12), ".xlsx")


def test_a_command_writes_one(tmp_path):
    run(tmp_path, "cycle", "four-bar", "--steps", "12", "-o", "four.xlsx").done()
    table, _ = sheets((tmp_path / "four.xlsx").read_bytes())
    assert len(table) == 14
