"""Layers of PyTorch: gradcheck, vmap, masks. Where it is not installed nothing is tried."""

import re

import pytest

import planar
from planar.foundation.errors import BadInput
from planar.guide.topics import read_page

torch = pytest.importorskip("torch")

FREE = ["crank.length", "coupler.length"]


def make(**more):
    return planar.torch.Linkage("crank-rocker", free=FREE, points=["B"], steps=24, **more)


def test_positions_are_those_of_a_run():
    linkage = make()
    position, solved = linkage(linkage.file_values)
    assert position.dtype == torch.float64
    assert solved.all()
    run = planar.prepared("crank-rocker", 24, "B")()
    torch.testing.assert_close(position, torch.tensor(run.position["B"].copy()))


@pytest.mark.parametrize(
    ("stem", "free", "points", "over"),
    [
        ("crank-rocker", FREE, ["B"], {}),
        ("slider-crank", ["crank.length", "rod.length", "O.velocity"], ["B", "E"], {}),
        ("geared-five-bar", ["OA.length", "O.position"], None, {}),
        ("double-butterfly", ["OA.length"], None, {"stop": 0.4, "start": 0.0}),
    ],
)
@pytest.mark.parametrize("rates", [False, True])
def test_gradcheck_is_clean(stem, free, points, over, rates):
    linkage = planar.torch.Linkage(stem, free, points, 6, rates=rates, **over)
    values = linkage.file_values.repeat(2, 1)
    values[0] *= 1.01
    solved = linkage(values)[-1]
    assert solved.any()
    sizes = [float(each.abs().max()) for each in linkage(values)[:-1]]

    def told(values):
        return tuple(each / size for each, size in zip(linkage(values)[:-1], sizes, strict=True))

    assert torch.autograd.gradcheck(told, (values.requires_grad_(),), eps=1e-6, atol=1e-4, rtol=1e-3)


def test_vmap_and_gradients_of_each_go_over_it():
    linkage = make(rates=True)
    values = linkage.file_values * (1.0 + 0.01 * torch.arange(5.0, dtype=torch.float64)[:, None])

    def loss(values):
        return sum((each**2).sum() for each in linkage(values)[:-1])

    for one, other in zip(torch.func.vmap(linkage)(values), linkage(values), strict=True):
        torch.testing.assert_close(one, other)
    each = torch.stack([torch.func.grad(loss)(one) for one in values])
    torch.testing.assert_close(torch.func.vmap(torch.func.grad(loss))(values), each)
    slopes = torch.func.jacrev(lambda values: linkage(values)[0])(values[0])
    assert slopes.shape == (25, 2, 2)
    inner = torch.func.vmap(lambda one: torch.func.vmap(linkage)(one.expand(3, 2)))(values)
    assert inner[0].shape == (5, 3, 25, 2)


def test_what_is_not_solved_is_masked_and_has_no_nan():
    linkage = make(rates=True)
    nan = float("nan")
    values = torch.tensor([[0.9, 0.1], [nan, 0.1], [0.15, 0.18]], dtype=torch.float64, requires_grad=True)
    *told, solved = linkage(values)
    assert not solved[:2].any()
    assert 0 < solved[2].sum() < 25
    sum((each**2).sum() for each in told).backward()
    assert torch.isfinite(values.grad).all()
    assert not values.grad[:2].any()


def test_single_precision_and_second_derivatives_are_refused():
    linkage = make()
    with pytest.raises(BadInput, match="double precision"):
        linkage(linkage.file_values.float())
    with pytest.raises(BadInput, match=r"\(..., 2\)"):
        linkage(torch.ones(3, dtype=torch.float64))
    values = linkage.file_values.clone().requires_grad_()
    (slope,) = torch.autograd.grad((linkage(values)[0] ** 2).sum(), values, create_graph=True)
    with pytest.raises(BadInput, match="no second"):
        slope.sum().backward()


def test_a_layer_learns_a_dimension():
    linkage = make()
    with torch.no_grad():
        wanted = linkage(linkage.file_values)[0]
    factors = torch.nn.Parameter(torch.tensor([1.1, 0.95], dtype=torch.float64))
    steps = torch.optim.LBFGS([factors], max_iter=60, line_search_fn="strong_wolfe", tolerance_grad=1e-14)

    def loss():
        steps.zero_grad()
        off = 1e4 * ((linkage(factors * linkage.file_values)[0] - wanted) ** 2).sum()
        off.backward()
        return off

    steps.step(loss)
    torch.testing.assert_close(factors.detach(), torch.ones(2, dtype=torch.float64), atol=1e-5, rtol=0.0)
    assert "crank.length, coupler.length" in repr(linkage)


def test_the_snippets_of_the_guide_run():
    snippets = re.findall(r"```py\n(.*?)```", read_page("design/gradients"), re.DOTALL)
    own = [each for each in snippets if "torch" in each]
    assert own
    for each in own:
        names = {}
        exec(each, names)
        assert names["values"].grad.shape == (2,)
