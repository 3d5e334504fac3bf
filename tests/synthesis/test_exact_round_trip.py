"""Known four-bars and slider-cranks in the rows of their tasks, and written back from these, by closed forms."""

import numpy as np
import pytest

import planar
from planar.model.link_shapes import link_shape
from planar.synthesis.exact.exact_linkage import exact_linkage
from planar.synthesis.exact.relations.condition_count import count_parts
from planar.synthesis.exact.relations.exact_problem import ExactProblem
from planar.synthesis.exact.relations.known_linkage import KnownLinkage, component_unknowns, linkage_values
from planar.synthesis.exact.tracking.family_names import name_family
from planar.synthesis.task.freedom import count_freedom
from planar.synthesis.task.starts import start_mechanisms

UNITS = {"length": "m", "angle": "rad"}


def xy(place):
    return [float(place.real), float(place.imag)]


def link(rng, places):
    """A link by its ends or by points, and its axes where its points are at these places."""
    (one, p), (two, q), *others = places.items()
    if rng.random() < 0.5:
        way, origin = (q - p) / abs(q - p), p
        value = {"ends": [one, two], "length": float(abs(q - p))}
        value |= {"points": {name: xy((at - p) / way) for name, at in others}} if others else {}
    else:
        way = np.exp(1j * rng.uniform(-np.pi, np.pi))
        origin = p if rng.random() < 0.5 else p + complex(*rng.normal(size=2))
        value = {"points": {name: xy((at - origin) / way) for name, at in places.items()}}
    return value, (complex(origin), complex(way))


def four_bar(rng):
    a, b, c, d, p = (complex(*rng.uniform(-1.0, 1.0, 2)) for _ in range(5))
    made = {"AB": {"A": a, "B": b}, "BC": {"B": b, "C": c, "P": p}, "DC": {"D": d, "C": c}}
    links = {name: link(rng, places) for name, places in made.items()}
    frame = {"AD": {"points": {"A": xy(a), "D": xy(d)}}}
    value = {"frame": "AD", "links": frame | {name: each for name, (each, _) in links.items()}}
    value["pairs"] = [{"turning": pin} for pin in "ABCD"]
    return value, {name: axes for name, (_, axes) in links.items()}, {"B": b, "C": c, "P": p}


def slider_crank(rng):
    o, a, b, p = (complex(*rng.uniform(-1.0, 1.0, 2)) for _ in range(4))
    angle = rng.uniform(-np.pi, np.pi)
    through = b - rng.uniform(0.3, 1.0) * np.exp(1j * angle)
    made = {"c": {"O": o, "A": a}, "rod": {"A": a, "B": b, "P": p}}
    links = {name: link(rng, places) for name, places in made.items()}
    links["p"] = {"points": {"B": [0.0, 0.0]}}, (b, complex(np.exp(1j * angle)))
    by_name = rng.random() < 0.5
    frame = {"f": {"points": {"O": xy(o)} | ({"G": xy(through)} if by_name else {})}}
    line = {"through": "G" if by_name else xy(through), "angle": float(angle)}
    value = {"frame": "f", "links": frame | {name: each for name, (each, _) in links.items()}}
    value["pairs"] = [{"turning": pin} for pin in "OAB"]
    value["pairs"].append({"sliding": "s", "links": ["f", "p"], "line": line, "point": "B"})
    return value, {name: axes for name, (_, axes) in links.items()}, {"A": a, "B": b, "P": p}


def file_of(value, axes, sketch):
    crank = next(iter(axes))
    first = value["pairs"][0]["turning"]
    inputs = [{"pair": first, "position": float(np.angle(axes[crank][1]))}]
    return {"planar": 1, "units": UNITS, **value, "inputs": inputs, "sketch": {k: xy(z) for k, z in sketch.items()}}


class Kinematics:
    """A linkage by closed forms, from its own file."""

    def __init__(self, mechanism):
        self.mechanism = mechanism
        self.shapes = {each.name: link_shape(each) for each in mechanism.links}
        self.is_slider = mechanism.frame == "f"

    def at(self, name, point):
        place = self.shapes[name].position(point)
        return complex(float(place.x), float(place.y))

    def placed(self, name, one, p, q, other):
        """The axes of a link of which two points are at places."""
        way = (q - p) / (self.at(name, other) - self.at(name, one))
        return p - self.at(name, one) * way, way

    def assemblies(self, crank):
        """Both assemblies: the axes of all links, and the displacement of the slide."""
        names = ("f", "c", "rod", "O", "A", "B") if self.is_slider else ("AD", "AB", "BC", "A", "B", "C")
        frame, first, coupler, fixed, joint, last = names
        pivot, turn = self.at(frame, fixed), np.exp(1j * crank)
        origin = pivot - self.at(first, fixed) * turn
        b = origin + self.at(first, joint) * turn
        rod = abs(self.at(coupler, last) - self.at(coupler, joint))
        for sign in (1.0, -1.0):
            if self.is_slider:
                line = self.mechanism.pairs[-1].line
                through = self.at("f", line.through)
                way = np.exp(1j * float(line.angle))
                local = (b - through) / way
                along = local.real + sign * np.sqrt(complex(rod**2 - local.imag**2)).real
                c = through + along * way
                links = {"p": (c, way), "s": along}
            else:
                d = self.at("AD", "D")
                rocker = abs(self.at("DC", "C") - self.at("DC", "D"))
                off = d - b
                x = (abs(off) ** 2 + rod**2 - rocker**2) / (2.0 * abs(off))
                c = b + (x + sign * 1j * np.sqrt(complex(rod**2 - x**2)).real) * off / abs(off)
                links = {"DC": self.placed("DC", "D", d, c, "C")}
            yield links | {first: (origin, turn), coupler: self.placed(coupler, joint, b, c, last)}

    def follow(self, axes, steps):
        """Axes at steps of the crank from the first, of the same assembly; None where it comes apart."""
        first = next(iter(axes))
        coupler = "rod" if self.is_slider else "BC"
        start = float(np.angle(axes[first][1]))
        which = int(np.argmin([abs(each[coupler][1] - axes[coupler][1]) for each in self.assemblies(start)]))
        found = [[*self.assemblies(start + step)][which] for step in steps]
        is_closed = all(abs(abs(each[coupler][1]) - 1.0) < 1e-9 for each in found)
        return (start, found) if is_closed else (start, None)

    def result(self, wanted, links):
        """What a wanted item asks for, where links have these axes."""
        if "point" in wanted:
            origin, way = links["rod" if self.is_slider else "BC"]
            return np.array(xy(origin + way * self.at("rod" if self.is_slider else "BC", "P")))
        if "link" in wanted:
            origin, way = links[wanted["link"]]
            return np.array([*xy(origin), np.angle(way)])
        return np.array([links["s"] if wanted["to"] == "s" else np.angle(links["DC"][1])])


def entries(rng, kinematics, kind, start, steps, links):
    """A wanted item that a linkage meets."""
    coupler = "rod" if kinematics.is_slider else "BC"
    wanted = {"path": {"point": "P"}, "poses": {"link": coupler}}.get(
        kind, {"from": "O" if kinematics.is_slider else "A", "to": "s" if kinematics.is_slider else "D"}
    )
    results = [kinematics.result(wanted, each) for each in links]
    inputs = [float(start + step) for step in steps]
    timing = rng.choice(["none", "relative", "absolute"])
    if kind == "function":
        values = np.unwrap([each[0] for each in results]) if not kinematics.is_slider else [each[0] for each in results]
        pairs = [[at, float(value)] for at, value in zip(inputs, values, strict=True)]
        return wanted | {"pairs": pairs} | ({"absolute": True} if timing == "absolute" else {})
    told = [{"at": each[:2].tolist()} | ({"angle": float(each[2])} if kind == "poses" else {}) for each in results]
    if timing != "none":
        told = [each | {"input": at} for each, at in zip(told, inputs, strict=True)]
    more = {"absolute": True} if timing == "absolute" else {}
    return wanted | ({"through": told} if kind == "path" else {"poses": told}) | more


def known_task(seed):
    """A linkage at random, a task that it meets, with some of its numbers free, and the start, where these differ."""
    rng = np.random.default_rng(seed)
    while True:
        value, axes, sketch = (four_bar if rng.random() < 0.5 else slider_crank)(rng)
        maker = planar.from_dict(file_of(value, axes, sketch))
        kinematics = Kinematics(maker)
        kind = rng.choice(["path", "poses", "function"])
        steps = np.concatenate([[0.0], np.sort(rng.uniform(0.1, 1.5, rng.integers(1, 5)))])
        start, links = kinematics.follow(axes, steps)
        if links is not None:
            break
    wanted = entries(rng, kinematics, kind, start, steps, links)
    numbers = planar.dimensions(maker)
    names = [name for name in numbers if name.split(".")[0] in (*value["links"], "s")]
    names = [name for name in names if name not in ("p.B.x", "p.B.y", "s.turn")]
    if kind != "path":
        names = [name for name in names if ".P." not in name]
    free = [name for name in names if rng.random() < rng.choice([0.3, 0.6, 1.0])] or names
    return maker, axes, wanted, free


def problem_of(start, wanted, free):
    value = {"planar": 1, "units": UNITS, "start": planar.to_dict(start), "wanted": [wanted], "free": [*free]}
    task = planar.read_task(value)
    return ExactProblem(task, next(iter(start_mechanisms(task))))


def other_start(maker, free, seed):
    """The linkage with other values of the numbers that are sought."""
    rng, numbers = np.random.default_rng(seed + 1000), planar.dimensions(maker)
    return maker.with_values({name: numbers[name] + rng.uniform(0.001, 0.003) for name in free})


def greatest_residual(part, values):
    """Of the rows of a component, of the size of their terms."""
    if not part.family.row_count:
        return 0.0
    x = component_unknowns(part, values)
    still = [np.zeros_like(each) for each in part.member.parts]
    f, slope, _ = part.family.rows_at(x[:, None], part.member, still, np.zeros(1))
    return np.max(np.abs(f[:, 0]) / (1.0 + np.abs(slope[:, :, 0] * x).sum(axis=1)))


def entry_misses(wanted, kinematics, inputs):
    """By how much the better assembly of each entry misses what is wanted; of a function that counts by differences
    for either assembly of the first."""
    expected = wanted.get("through") or wanted.get("poses") or wanted["pairs"]
    is_angle = np.array([False, False, True]) if "link" in wanted else np.full(1, wanted.get("to") == "D")
    is_relative = "pairs" in wanted and not wanted.get("absolute")
    first = [kinematics.result(wanted, each) for each in kinematics.assemblies(inputs[0])]
    for zero in [each - expected[0][1] for each in first] if is_relative else [0.0]:
        misses = []
        for at, entry in zip(inputs, expected, strict=True):
            told = [entry[1]] if "pairs" in wanted else [*entry["at"], *([entry["angle"]] if "angle" in entry else [])]
            off = np.array([kinematics.result(wanted, each) - zero - told for each in kinematics.assemblies(at)])
            off = np.where(is_angle[: off.shape[1]], np.angle(np.exp(1j * off)), off)
            misses.append(np.abs(off).max(axis=1).min())
        yield max(misses)


@pytest.mark.parametrize("seed", [1, 7, 11, 24, 47, 50])
def test_known_linkages_meet_their_rows_are_written_from_them_and_counted_by_rank(seed):
    maker, axes, wanted, free = known_task(seed)
    sought = problem_of(maker, wanted, free).free  # others of those that are free are given
    problem = problem_of(other_start(maker, sought, seed), wanted, free)
    values = linkage_values(problem, KnownLinkage(maker, problem.items, axes))
    assert max(greatest_residual(each, values) for each in (*problem.components, problem.fixed)) < 1e-11
    written = exact_linkage(problem, values, "written")
    numbers, known = planar.dimensions(written.mechanism), planar.dimensions(maker)
    names = [name for name in known if name.split(".")[0] in (*axes, maker.frame, "s") and name not in sought]
    names = [name for name in names if name in numbers]  # a link that takes poses is written by points
    np.testing.assert_allclose([numbers[name] for name in names], [known[name] for name in names], atol=1e-12)
    assert {*sought} == {*written.numbers} or written.opposite
    assert min(entry_misses(wanted, Kinematics(written.mechanism), written.inputs[0].tolist())) < 1e-9
    parts, count = count_parts(problem), count_freedom(problem.task, problem.mechanism)
    assert sum(each.excess for each in parts) == count.excess
    assert sum(each.open for each in parts) == count.free - count.met


def pivots_given(*free, count=3):
    """A task of poses of a coupler of which joints and cranks are sought."""
    start = planar.to_dict(planar.load("four-bar"))
    start["links"]["BC"] = {"points": {"B": [0, 0], "C": [66, 0]}}
    poses = [{"at": [30 * k, 5 * k * k], "angle": 20 * k} for k in range(count)]
    value = {"planar": 1, "units": {"length": "mm", "angle": "deg"}, "start": start, "free": [*free]}
    return value | {"wanted": [{"link": "BC", "poses": poses}]}


def parts_of(value):
    task = planar.read_task(value)
    return ExactProblem(task, next(iter(start_mechanisms(task)))).components


def test_dyads_are_alike_only_where_the_numbers_given_to_them_are():
    for free, alike in ((("AB.length", "BC.B", "DC.length", "BC.C"), False), (("AD", "AB", "BC", "DC"), True)):
        names = [*free] if not alike else ["AD.A", "AD.D", "BC.B", "BC.C", "AB.length", "DC.length"]
        one, other = parts_of(pivots_given(*names))
        assert name_family(one.family).text == name_family(other.family).text
        assert np.array_equal(one.member.parts[0], other.member.parts[0]) == alike


@pytest.mark.parametrize(
    ("free", "count", "sentence"),
    [
        (("AB.length", "BC.B"), 3, "with the numbers that are free: 3 conditions on the link 'DC' are too many"),
        (
            ("AB.length", "BC.B", "DC.length", "BC.C"),
            4,
            "1 condition on the link 'AB' is too many, 1 condition on the link",
        ),
        (("AB.length", "DC.length", "BC.B", "BC.C", "AD.A"), 5, "exactly .*: 2 conditions on the link 'DC' are too"),
    ],
)
def test_a_part_that_cannot_meet_its_conditions_is_refused_by_its_links(free, count, sentence):
    with pytest.raises(planar.BadInput, match=sentence):
        planar.synthesise(pivots_given(*free, count=count), complete=True)


def test_numbers_that_change_nothing_are_refused_by_name():
    maker, *_ = known_task(5)
    with pytest.raises(planar.BadInput, match=r"depends on 'BC\.P\.x'"):
        problem_of(maker, {"from": "A", "to": "D", "pairs": [[0, 0], [1, 1]]}, ["BC.length", "BC.P.x"])


def test_families_of_many_numbers_have_a_name_whatever_the_order_of_links():
    maker, _, wanted, _ = known_task(0)
    other = planar.to_dict(maker)
    other["links"] = dict(reversed(other["links"].items()))
    free = ["f.O.y", "rod.P.x"]
    (one,), (two,) = (problem_of(each, wanted, free).components for each in (maker, planar.from_dict(other)))
    assert len(one.given) > 6 and name_family(one.family).text == name_family(two.family).text


@pytest.mark.parametrize(("place", "is_far"), [([1.8, 2.2], True), ([1.0, 1.2], False)])
def test_a_point_nearer_than_its_given_coordinate_is_of_no_linkage(place, is_far):
    """P.y = +-sqrt(|BP|^2 - 1.2^2) is real only where P is farther from B than 1.2 m; the trace shows that the two
    solutions are all."""
    links = {
        "AD": {"points": {"A": [0.0, 0.0], "D": [3.0, 0.0]}},
        "AB": {"ends": ["A", "B"], "length": 1.0},
        "BC": {"points": {"B": [0.0, 0.0], "C": [2.5, 0.3], "P": [1.2, 0.8]}},
        "DC": {"ends": ["D", "C"], "length": 2.0},
    }
    start = {"planar": 1, "units": UNITS, "frame": "AD", "links": links, "pairs": [{"turning": pin} for pin in "ABCD"]}
    start |= {"inputs": [{"pair": "A", "position": 1.0}], "sketch": {"B": [0.54, 0.84], "C": [2.9, 2.0]}}
    wanted = {"point": "P", "through": [{"at": place, "input": 1.0}], "absolute": True}
    task = {"planar": 1, "units": UNITS, "start": start, "wanted": [wanted], "free": ["BC.P.y", "DC.length"]}
    listed = planar.synthesise(task, complete=True)
    assert (listed.found, listed.complete) == (2, "numerically complete")
    offset = np.sqrt(abs(complex(*place) - np.exp(1.0j)) ** 2 - 1.2**2 + 0.0j).real
    values = sorted(each.numbers["BC.P.y"] for each in listed.designs)
    np.testing.assert_allclose(values, [-offset, offset] if is_far else [], atol=1e-9)


def test_both_senses_of_a_line_through_its_pin_are_one_linkage():
    """A block that swings on a line through its crank's pin turns alike whichever way the line goes."""
    links = {
        "f": {"points": {"O": [0.0, 0.0], "D": [1.0, -0.4]}},
        "c": {"ends": ["O", "A"], "length": 0.4},
        "rod": {"points": {"A": [0.0, 0.0]}},
    }
    pairs = [{"turning": "O"}, {"turning": "A"}]
    pairs.append({"sliding": "s", "on": "rod", "block": "D", "line": {"through": "A", "angle": 0.3}})
    start = {"planar": 1, "units": UNITS, "frame": "f", "links": links, "pairs": pairs}
    start |= {"inputs": [{"pair": "O", "position": 1.0}], "sketch": {"A": [0.2, 0.35]}}
    inputs = np.array([0.5, 1.1, 1.7])
    turned = np.angle(1.1 - 0.4j - 0.4 * np.exp(1j * inputs))
    function = {"from": "O", "to": "D", "pairs": np.stack([inputs, turned], axis=1).tolist()}
    task = {"planar": 1, "units": UNITS, "start": start, "wanted": [function], "free": ["f.D.x"]}
    values = [each.numbers["f.D.x"] for each in planar.synthesise(task, complete=True).designs]
    assert len({round(value, 9) for value in values}) == len(values)
    assert min(abs(value - 1.1) for value in values) < 1e-9
