"""A candidate of a search as a design: written, and judged by the general path."""

from __future__ import annotations

import numpy as np

from planar.document.dimensions import file_dimensions
from planar.foundation.errors import BadInput
from planar.synthesis.design_search import Candidate, DesignSearch
from planar.synthesis.judgement.judgement import DesignJudge
from planar.synthesis.judgement.written_design import write_design
from planar.synthesis.synthesis import SynthesisedDesign


def judge_candidate(
    search: DesignSearch, judge: DesignJudge, candidate: Candidate, number: int
) -> SynthesisedDesign | None:
    """A candidate with its judgement, named by a `number`; None where no file can describe it."""
    equations = search.equations
    values = tuple(search.shown(k, candidate) for k in range(len(equations)))
    inputs = [y[:, -1] * item.input_scale for item, y in zip(equations, candidate.unknowns, strict=True)]
    y = search.most_regular(candidate)
    name = f"{search.task.name}: {search.mechanism.name} {number}"
    try:
        input_position = float(y[-1] * equations[0].input_scale)
        mechanism = write_design(equations[0].design, candidate.numbers, y, input_position, name)
    except BadInput:
        return None
    judgement = judge.judge(mechanism, inputs, values)
    misses = np.concatenate(judgement.misses)
    written = file_dimensions(mechanism)
    return SynthesisedDesign(
        mechanism,
        float(np.sqrt(np.mean(misses**2))),
        float(misses.max()),
        judgement.misses,
        judgement.inputs,
        judgement.defects,
        search.mechanism.name,
        {key: float(written[key].value) for key in candidate.numbers},
    )
