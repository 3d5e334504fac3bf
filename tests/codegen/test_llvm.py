"""What kernels compute equals what casadi computes: runs of designs against one."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import planar
from planar.batch.march import designs_writer, kernel, runs
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.kernel import BareAngle, kernel_equations
from planar.batch.march.runs import LANES, KernelRequest, designs_kernel
from planar.batch.reference_design import reference_design
from planar.codegen import instructions, llvm_compile, printed_formula
from planar.codegen.instructions import MAX_INSTRUCTIONS, CosSin, expand_angle_sums
from planar.codegen.llvm_compile import allocate_aligned, compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.codegen.llvm_linear import LinearSystems
from planar.equations.mechanism_numbers import equation_structure
from planar.foundation.errors import BadInput, Outcome
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation
from planar.foundation.recorded_formula import formula_of_results
from planar.model.mechanism import named_points
from planar.solving.position import PositionSolver
from tests.builders import designs_around
from tests.draws import first_cases, part
from tests.known import MODELS
from tests.linkages import random_linkage
from tests.watchdog import watched

PART = slice(30, 331)
"""Rows of a cycle of 360 steps that are away from its limits."""


def arguments(motion, points):
    """A run of a motion's rows as a batch of one design."""
    solver = PositionSolver(motion.mechanism)
    named = {each.name: each.members[0] for each in named_points(motion.mechanism)}
    members = [named[point] for point in points]
    positions = [motion.inputs[driven.pair].position[PART] for driven in motion.mechanism.inputs]
    u = np.stack(positions, axis=1) / solver.input_scale
    places = [solver.shapes[link].position(name) for link, name in members]
    return DesignBatch(
        solver.functions,
        motion.mechanism,
        solver.inputs.p[:, None],
        np.array([[part / solver.unit] for place in places for part in (place.x, place.y)]),
        motion.course.unknowns[PART][0][:, None],
        u - u[0],
        u[0][:, None],
        solver.inputs.u1[:, None],
        solver.inputs.u2[:, None],
        tuple(link for link, _ in members),
        True,
        solver.tolerance,
        1.0,
    )


def repeated(given, designs):
    """The same design so many times."""
    return given.select(np.zeros(designs, dtype=int))


def run(batch):
    """The points and the good steps of a batch."""
    out = allocate_aligned(len(batch.input_offsets), batch.output_row_count, batch.p.shape[1])
    return out, runs.run_compiled(batch, out)


@pytest.mark.parametrize("stem", part([stem for stem, mechanism in MODELS.items() if mechanism.inputs], 9))
def test_a_run_of_a_model_is_the_one_that_casadi_gives(stem):
    mechanism = MODELS[stem]
    try:
        motion = planar.cycle(mechanism, pair=mechanism.inputs[0].pair)
    except BadInput:  # a slide without limits
        at = mechanism.inputs[0].position
        motion = planar.cycle(mechanism, start=at, stop=at + 0.1, pair=mechanism.inputs[0].pair)
    assert motion.outcome is Outcome.SOLVED
    points = motion.point_names[-3:]
    given = repeated(arguments(motion, points), 3)
    if not given.functions.is_square:
        with pytest.raises(UnsupportedOperation, match="more than once"):
            run(given)
        return
    out, good = run(given)
    np.testing.assert_array_equal(out, np.repeat(out[:, :, :1], 3, axis=2))
    # what is near a change point, or moves too far in a step, is left to the general path; a step condemns that before
    first = int(good[0])
    near = [row - PART.start for row in motion.course.singular_rows if row >= PART.start]
    assert first == len(out) or min(near, default=0) <= first + 2
    unit = PositionSolver(motion.mechanism).unit
    for order, what in enumerate(("position", "velocity", "acceleration")):
        for k, point in enumerate(points):
            wanted = getattr(motion.point(point), what)[PART][:first]
            told = unit * out[:first, 2 * (len(points) * order + k) : 2 * (len(points) * order + k) + 2, 0]
            scale = max(float(np.abs(wanted).max(initial=0.0)), unit)
            np.testing.assert_allclose(told, wanted, rtol=0, atol=(1e-12, 1e-9, 2e-7)[order] * scale)


@pytest.mark.parametrize(
    ("stem", "at_two"),
    first_cases(
        [
            *[("four-bar", True), ("offset-slider-crank", False), ("crank-and-slotted-lever", True)],
            *[("four-bar", False), ("offset-slider-crank", True), ("crank-and-slotted-lever", False)],
        ],
        3,
    ),
)
def test_a_run_from_signs_is_that_from_the_unknowns(stem, at_two):
    """Designs at one input, or at two; one has no start."""
    motion = planar.cycle(MODELS[stem])
    given = repeated(arguments(motion, motion.point_names[-1:]), 20)
    one, other = given.z0[:, 0], motion.course.unknowns[PART][1]
    step = given.input_offsets[1]
    if at_two:
        given.u0[:, 7], given.z0[:, 7] = given.u0[:, 7] + step, other
    given.u0[:, 3] = np.nan
    equations = kernel.batch_equations(given)
    assert not equations.has_newton_blocks
    e = equations.equations
    sides = ca.Function("sides", [e.z, e.u, e.p], [equations.sides])(one, given.u0[:, 0], given.p[:, 0])
    signs = np.repeat(np.sign(sides.full()), 20, axis=1)
    wanted, found = (run(given._replace(signs=each)) for each in (None, signs))
    np.testing.assert_array_equal(found[1], wanted[1])
    assert found[1][3] == 0
    assert np.delete(found[1], 3).min() == len(given.input_offsets)
    np.testing.assert_allclose(found[0], wanted[0], rtol=0, atol=1e-9 * np.nanmax(np.abs(wanted[0])))


def test_cos_and_sin_of_sums_are_put_together_from_the_angles_own():
    made_of = InstructionList()
    a, b, c = (made_of.add_input(("z", k)) for k in range(3))
    turned = [CosSin(*(made_of.add_input((part, k)) for part in ("zc", "zs"))) for k in range(2)]
    inside = made_of.add("sub", made_of.add("add", a, made_of.add("mul", made_of.add_constant(2.0), b)), c)
    wanted = [made_of.add("cos", inside), made_of.add("sin", inside)]
    made, numbers = expand_angle_sums(made_of, wanted, {a: turned[0], b: turned[1]})
    values = {
        ("zc", 0): np.cos(0.3),
        ("zs", 0): np.sin(0.3),
        ("zc", 1): np.cos(1.1),
        ("zs", 1): np.sin(1.1),
        ("z", 2): 0.7,
    }
    with_angles = {
        "cos": np.cos,
        "sin": np.sin,
        "neg": np.negative,
        "add": np.add,
        "sub": np.subtract,
        "mul": np.multiply,
    }
    found = []
    for value in made.instructions:
        if value.operation == "input":
            found.append(values.get(value.key, np.nan))  # the angles' own values stand nowhere
        elif value.operation == "const":
            found.append(value.number)
        else:
            found.append(with_angles[value.operation](*(found[k] for k in value.operands)))
    angle = 0.3 + 2 * 1.1 - 0.7
    np.testing.assert_allclose([found[k] for k in numbers], [np.cos(angle), np.sin(angle)], atol=1e-15)


def test_what_is_not_a_number_is_not_good():
    motion = planar.cycle(MODELS["crank-rocker"])
    given = repeated(arguments(motion, motion.point_names[-1:]), 2)
    given.p[0, 1] = np.nan
    _, good = run(given)
    assert good.tolist() == [len(given.input_offsets), 0]


@pytest.mark.parametrize("stem", part(["crank-rocker", "004-QR", "double-butterfly", "geared-five-bar"], 2))
def test_assemblies_are_corrected_and_steps_come_to_the_unknowns_as_by_the_equations(stem):
    motion = planar.cycle(MODELS[stem], pair=MODELS[stem].inputs[0].pair)
    given = repeated(arguments(motion, motion.point_names[-3:]), 3)
    given.z0[:] += 1e-3 * np.arange(3)
    blocks = [block.block_index for block in given.functions.equations.blocks][-1:] * 3
    is_converged, _, z, *_ = runs.correct_designs(given, blocks, 6)
    wanted = given.functions.correct_samples(given.z0.T, given.u0.T, given.p.T)
    assert is_converged.all()
    np.testing.assert_allclose(np.exp(1j * z), np.exp(1j * wanted.T), atol=1e-10)
    steps = np.array([1, 20, 100])
    wanted = motion.course.unknowns[PART][steps - 1]
    np.testing.assert_allclose(np.exp(1j * runs.last_good_unknowns(given, steps)), np.exp(1j * wanted.T), atol=1e-9)


@pytest.mark.parametrize("stem", ["stephenson-2-six-bar", "double-butterfly"])
def test_blocks_too_large_for_expressions_are_solved_in_numbers_to_the_same(monkeypatch, stem):
    mechanism, caches = MODELS[stem], (runs._designs_kernel_or_reason,)
    designs = designs_around(mechanism, 0.005, 3)
    wanted = planar.sweep(mechanism, designs, 30)
    monkeypatch.setattr(kernel, "MAX_EXPRESSION_UNKNOWNS", 3)
    for cache in (kernel.kernel_equations, *caches):
        cache.cache_clear()
    found = planar.sweep(mechanism, designs, 30)
    for cache in (kernel.kernel_equations, *caches):
        cache.cache_clear()
    assert (found.general, found.whole.all()) == (0, True)
    for point in found.points:
        for order in ("position", "velocity", "acceleration"):
            np.testing.assert_allclose(
                getattr(found, order)[point], getattr(wanted, order)[point], rtol=1e-8, atol=1e-8
            )


def test_source_says_each_value_once_and_takes_names_again():
    made = InstructionList()
    a, b = (made.add_input(("p", k)) for k in range(2))
    root = made.add("sqrt", b)
    whole = made.add("mul", made.add("add", a, b), root)
    rest = made.add("mul", made.add("sub", root, a), root)
    wanted = [made.add("neg", whole), made.add("minnum", whole, made.add("mul", rest, rest)), a]
    assert printed_formula.write_numpy(made, wanted, (a, b)).splitlines() == [
        "def values(x0, x1):",
        "    r0 = sqrt(x1)",
        "    r1 = r0 * (x0 + x1)",
        "    r0 = r0 * (r0 - x0)",
        "    r2 = -r1",
        "    r0 = r0 * r0",
        "    r0 = minnum(r1, r0)",
        "    return (r2, r0, x0, )",
    ]
    found = printed_formula.compile_numpy(made, wanted, (a, b))(np.array([1.0, 2.0]), 4.0)
    np.testing.assert_allclose(np.stack(found), [[-10.0, -12.0], [4.0, 0.0], [1.0, 2.0]])
    with pytest.raises(UnsupportedOperation, match="no atan"):
        printed_formula.write_numpy(made, [made.add("atan", a)], (a, b))


@pytest.mark.parametrize("seed", range(40))
def test_a_printed_formula_is_what_its_instructions_say_one_by_one(seed):
    """Sums of products, roots, least and greatest values of random operands, some used once and some often."""
    rng = np.random.default_rng(seed)
    made: InstructionList[int] = InstructionList()
    numbers = [made.add_input(k) for k in range(3)] + [made.add_constant(float(rng.normal()))]
    arities = {"add": 2, "sub": 2, "mul": 2, "minnum": 2, "maxnum": 2, "less": 2, "where": 2, "abs": 1, "cos": 1}
    for _ in range(60):
        operation = str(rng.choice([*arities]))
        numbers.append(
            made.add(
                operation,
                *(numbers[-int(rng.integers(1, min(9, len(numbers) + 1)))] for _ in range(arities[operation])),
            )
        )
    wanted = [int(number) for number in rng.choice(numbers, 5)]
    formula = formula_of_results(made, wanted)
    function = printed_formula.FormulaFunction(formula, (2, 1), ((1, len(wanted)),))
    places = rng.normal(size=(3, 9))
    one_by_one = np.array([formula.evaluate(place.tolist()) for place in places.T], dtype=float).T
    for _ in range(printed_formula.MAX_INTERPRETED_CALLS + 2):  # printed in the end
        floats = [function.values(place[:2].tolist(), place[2:].tolist()) for place in places.T]
        np.testing.assert_array_equal(np.transpose(floats), one_by_one)
        arrays = function.evaluate_entries(9, places[:2], places[2:])
        np.testing.assert_allclose(arrays, one_by_one, rtol=1e-13, atol=1e-13)


# how much is printed


IDLE = planar.load(Path(__file__).parents[1] / "data" / "idle-slide.json")
"""Six links: the slide of S4 places links L2 and L3 and does not turn them, but stands in the equations that do."""


def all_points(mechanism, rates):
    """The function that a sweep of the first input runs for all points that move."""
    common = reference_design(mechanism, mechanism.inputs[0].pair)
    links = tuple(common.point_member(name)[0] for name in common.select_points(None))
    equations = kernel_equations(common.functions, equation_structure(common.mechanism))
    return designs_kernel(KernelRequest(equations, links, rates, LANES))


@pytest.mark.parametrize("rates", [False, True])
@pytest.mark.parametrize("seed", [None, 406027, 406063, 406117, 406230, 406299, 407086])
def test_what_is_printed_ends(seed, rates):
    mechanism = IDLE if seed is None else planar.from_dict(random_linkage(seed, 6).value)
    with watched(10):
        assert all_points(mechanism, rates).ir.count("\n") < MAX_INSTRUCTIONS / 3


def test_a_slide_that_turns_nothing_leaves_a_sweep_as_the_cycle():
    with watched(10):
        motion = planar.cycle(IDLE, 10, -0.07, 0.03)
        found = planar.sweep(IDLE, {"S7.velocity": [1.9]}, 10, start=-0.07, stop=0.03)
    assert found.whole.all()
    assert found.general == 0
    for point in found.points:
        for order in ("position", "velocity", "acceleration"):
            wanted = getattr(motion.point(point), order)
            np.testing.assert_allclose(getattr(found, order)[point][0], wanted, atol=1e-11 * (1 + np.abs(wanted).max()))


def test_what_is_wanted_before_it_is_known_is_not_printed(monkeypatch):
    def written(self):
        raise BareAngle(("z", 0))

    monkeypatch.setattr(designs_writer._DesignsKernelWriter, "write", written)
    with watched(10), pytest.raises(UnsupportedOperation, match="a later one"):
        equations = kernel_equations(reference_design(IDLE, None).functions, equation_structure(IDLE))
        designs_writer.write_designs_kernel(KernelRequest(equations, ("L2",), False, 16))


def test_what_cancels_is_nothing():
    made = InstructionList()
    value = made.add("mul", *(made.add_input(("p", k)) for k in range(2)))
    less = made.add("neg", value)
    assert [made.constant_value(made.add("add", *both)) for both in ((value, less), (less, value))] == [0.0, 0.0]


def test_designs_of_a_longer_function_are_followed_and_it_is_printed_once_in_vain(monkeypatch):
    mechanism, tried, really = MODELS["stephenson-1-six-bar"], [], designs_writer.write_designs_kernel

    def printing(request):
        tried.append(request)
        return really(request)

    at, pair = mechanism.inputs[0].position, mechanism.inputs[0].pair
    designs, run_ = {f"{pair}.velocity": np.linspace(1, 2, 6)}, {"start": at, "stop": at + 0.1, "pair": pair}
    wanted = planar.sweep(mechanism, designs, 5, **run_)
    monkeypatch.setattr(instructions, "MAX_INSTRUCTIONS", 100)
    monkeypatch.setattr(runs, "write_designs_kernel", printing)
    runs._designs_kernel_or_reason.cache_clear()
    found = planar.sweep(mechanism, designs, 5, block=2, **run_)
    runs._designs_kernel_or_reason.cache_clear()
    assert len({request[1:] for request in tried}) == len(tried) > 0
    assert (wanted.general, found.whole.all()) == (0, True)
    for point in found.points:
        np.testing.assert_allclose(found.acceleration[point], wanted.acceleration[point], rtol=1e-9, atol=1e-9)


def test_a_long_text_is_compiled_briefly(monkeypatch):
    plan = all_points(MODELS["crank-rocker"], True)
    usual, asked, really = llvm_compile.fingerprint(plan.ir), [], llvm_compile._target_machine

    def machine(code):
        asked.append(code)
        return really(code)

    monkeypatch.setattr(llvm_compile, "_target_machine", machine)
    llvm_compile._compile_object(plan.ir)
    monkeypatch.setattr(llvm_compile, "LONG_TEXT_LINES", plan.ir.count("\n") - 1)
    llvm_compile._compile_object(plan.ir)
    assert asked == [llvm_compile.CODEGEN_LEVEL, llvm_compile.FAST_CODEGEN_LEVEL]
    assert llvm_compile.fingerprint(plan.ir) != usual


def test_cosines_and_sines_of_lanes_have_all_their_digits():
    from planar.codegen.llvm_ir import IRWriter, write_cos_sin

    t = IRWriter(8)
    t.write_line("define void @turn(ptr %angle, ptr %cos, ptr %sin) {")
    for value, into in zip(write_cos_sin(t, t.load("%angle")), ("%cos", "%sin"), strict=True):
        t.store(value, into)
    t.write_line("ret void\n}")
    turn = llvm_compile.compile_function(t.module_text(), "turn", "array", "array", "array")
    right = np.arange(-20, 20) * (0.5 * np.pi)
    angles = np.concatenate([right, right + 0.25 * np.pi, np.random.default_rng(0).uniform(-1e4, 1e4, 800)])
    angles = np.append(angles, np.full(-len(angles) % 8, np.nan)).reshape(-1, 8)
    found = np.empty((2, *angles.shape))
    for row, (cos, sin) in zip(angles, found.swapaxes(0, 1), strict=True):
        turn(row.ctypes.data, cos.ctypes.data, sin.ctypes.data)
    np.testing.assert_allclose(found, [np.cos(angles), np.sin(angles)], rtol=4e-16, atol=1e-32)


def test_many_loads_are_of_groups_and_each_is_where_it_belongs():
    """Where a text loads hundreds of rows in one go, as of a cam with many pieces, code is still made in a moment."""
    from planar.codegen.llvm_ir import KEEP_ORDER, LOADS_IN_ORDER, IRWriter

    many, t = 400, IRWriter(16)
    t.write_line("define void @sum(ptr %rows, ptr %out) {")
    loaded = [t.load(t.element_pointer("%rows", str(k))) for k in range(many)]
    weighed = [t.binary("mul", each, t.constant(k + 1.0)) for k, each in enumerate(loaded)]
    t.store(t.add_all(weighed), "%out")
    t.write_line("ret void\n}")
    between = [part.count(" load ") for part in t.module_text().split(KEEP_ORDER)]
    assert max(between) <= LOADS_IN_ORDER
    total = llvm_compile.compile_function(t.module_text(), "sum", "array", "array")
    rows, out = np.random.default_rng(0).integers(-9, 9, (many, 16)).astype(float), np.empty(16)
    total(rows.ctypes.data, out.ctypes.data)
    np.testing.assert_array_equal(out, np.arange(1.0, many + 1.0) @ rows)


@pytest.mark.parametrize("count", [1, 2, 9])
def test_linear_systems_in_loops_are_solved_lane_by_lane(count):
    lanes = 4
    t = IRWriter(lanes)
    t.write_line("define void @solve(ptr %matrix, ptr %right, ptr %to) {")
    t.write_label("entry")
    systems = LinearSystems(t, count)
    columns = [t.load(t.double_pointer("%matrix", str(lanes * k))) for k in range(count * count)]
    least = systems.factorise(columns, count)
    right = [t.load(t.double_pointer("%right", str(lanes * k))) for k in range(count)]
    for k, value in enumerate([*systems.solve(right), least]):
        t.store(value, t.double_pointer("%to", str(lanes * k)))
    t.write_line("ret void")
    t.write_line("}")
    t.write_line(systems.function_text)
    solve = compile_function(t.module_text(), "solve", *["array"] * 3)
    rng = np.random.default_rng(count)
    matrix, right_side = rng.normal(size=(count, count, lanes)), rng.normal(size=(count, lanes))
    result = np.empty((count + 1, lanes))
    solve(matrix.ctypes.data, right_side.ctypes.data, result.ctypes.data)
    for lane in range(lanes):
        rows = matrix[:, :, lane].T
        np.testing.assert_allclose(rows @ result[:count, lane], right_side[:, lane], rtol=1e-9, atol=1e-12)
        ratios = np.diag(np.linalg.qr(rows)[1]) ** 2 / (rows**2).sum(axis=0)
        assert result[count, lane] == pytest.approx(ratios.min(), rel=1e-9)
