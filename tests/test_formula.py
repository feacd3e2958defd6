"""Text to expression: the grammar, exact numbers, and errors that point at the character."""

import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit import FormulaError, Surface
from implicit.formula import parse
from implicit.language.notation import write
from implicit.language.trees import x, y, z

READINGS = {
    "x^2 + y^2 = z": x**2 + y**2 - z,
    "2x y - sin(z)": 2 * x * y - sympy.sin(z),
    "2(x+1)(y-1)": (2 * x + 2) * (y - 1),
    "-x^2": -(x**2),
    "(-x)^2": x**2,
    "2^-1 x": x / 2,
    "x^2^3": x**8,
    "x**3": x**3,
    "1/2x": x / 2,
    "x/2/3": x / 6,
    "xyz": x * y * z,
    "x yz^2": x * y * z**2,
    "--x": x,
    "+x - -y": x + y,
    "0.1x + 1.25e-1 y": x / 10 + y / 8,
    ".5x + 2. y": x / 2 + 2 * y,
    "pi x + e^y": sympy.pi * x + sympy.exp(y),
    "sqrt(2)x^3": sympy.sqrt(2) * x**3,
    "2sin(x)cos(y)": 2 * sympy.sin(x) * sympy.cos(y),
    "exp(log(x))": x,
    "min(1, 2) x": x,
    "x\n + y\t= 1": x + y - 1,
    "x² + y³ = z¹²": x**2 + y**3 - z**12,
    "-x²": -(x**2),
    "2²x²y": 4 * x**2 * y,
    "xyz²": x * y * z**2,
    "(x + y)² - x⁻¹": (x + y) ** 2 - 1 / x,
    "x^2²": x**4,
    "sin(x)²": sympy.sin(x) ** 2,
    "x⁰ y": y,
    "2·x ⋅ y·-z": -2 * x * y * z,
    "2×x − y ÷ 4": 2 * x - y / 4,
    "2πx + π²": 2 * sympy.pi * x + sympy.pi**2,
    "xπ": sympy.pi * x,
}

# text, index of the character that cannot be read, a part of the message
FAULTS = [
    ("", 0, "empty"),
    ("   ", 0, "empty"),
    ("x^2 +", 5, "something is missing after +"),
    ("x^", 2, "ends too early"),
    ("x =", 3, "something is missing after ="),
    ("= 1", 0, "nothing on the left of ="),
    ("x = y = z", 6, "one equation"),
    ("x == y", 3, "single ="),
    ("(x + 1", 6, "closing bracket is missing"),
    ("2(x + (y - 1)", 13, "bracket at character 2"),
    ("x + 1)", 5, "without an opening one"),
    ("sin(x", 5, "closing bracket is missing"),
    ("()", 1, "nothing between the brackets"),
    ("max()", 4, "nothing between the brackets"),
    ("sinx", 0, "did you mean sin(x)?"),
    ("1 + sqrt2", 4, "did you mean sqrt(2)?"),
    ("sin x", 4, "did you mean sin(x)?"),
    ("sin^2(x)", 3, "write sin(...)^2"),
    ("x + cso(y)", 4, "did you mean cos?"),
    ("ln(x)", 0, "did you mean log?"),
    ("arctan(x)", 0, "did you mean atan?"),
    ("X^2 + y", 0, "did you mean x?"),
    ("x + SIN(y)", 4, "did you mean sin?"),
    ("x2 + y", 0, "did you mean x^2 or 2*x?"),
    ("a x", 0, "as a parameter: a=1"),
    ("xpi", 0, "did you mean x*pi?"),
    ("x + q_1", 4, "unknown name"),
    ("²x", 0, "missing before '²'"),
    ("x^²", 2, "missing before '²'"),
    ("x + ⁻²", 4, "missing before '⁻²'"),
    ("x²^3", 2, "a power of a power"),
    ("x² ³", 3, "a power of a power"),
    ("x² 3", 3, "write * for a product"),
    ("x⁻", 1, "unknown character"),
    ("sin²(x)", 3, "write sin(...)^2"),
    ("x + 0⁻¹", 4, "no real number"),
    ("x + 9⁹⁹⁹⁹⁹⁹", 5, "too large"),
    ("π2", 1, "write pi^2"),
    ("x + ·y", 4, "missing before '·'"),
    ("x – y", 2, "minus sign"),
    ("x × × y", 4, "missing before '×'"),
    ("|x|", 0, "abs(...)"),
    ("[x]", 0, "round brackets"),
    ("x < 1", 2, "write ="),
    ("x $ y", 2, "unknown character"),
    ("2 3", 2, "write 2*3"),
    ("x 3", 2, "write x^3"),
    ("x, y", 1, "decimal point"),
    ("1,5 x", 1, "decimal point"),
    ("sin(x, y)", 5, "takes one argument"),
    ("* x", 0, "missing before '*'"),
    ("x + * y", 4, "missing before '*'"),
    ("x / / y", 4, "missing before '/'"),
    ("x / 0", 2, "division by zero"),
    ("x / (1 - 1)", 2, "division by zero"),
    ("x + sqrt(-1)", 4, "no real number"),
    ("log(0) x", 0, "no real number"),
    ("(-8)^(1/3) x", 0, "no real number"),
    ("x + 9^9^9", 5, "too large"),
    ("1e99999999 x", 0, "too large"),
    ("(" * 200 + "x", 120, "levels of brackets"),
    ("-" * 500 + "x", 120, "levels of brackets"),
]


@pytest.mark.parametrize("text", READINGS)
def test_reads_as_written(text):
    assert parse(text) == READINGS[text]


@pytest.mark.parametrize(("text", "position", "message"), FAULTS)
def test_points_at_the_fault(text, position, message):
    with pytest.raises(FormulaError) as caught:
        parse(text)
    assert caught.value.position == position
    assert message in str(caught.value)
    lines = str(caught.value).split("\n")
    assert lines[2].index("^") == position + 2  # under the character, two columns in


def test_parameters_are_exact_and_all_used():
    assert Surface("x^2 = a", a=0.1) == Surface("x^2 = 1/10")
    with pytest.raises(ValueError, match="has no b"):
        Surface("x^2 = a", a=1, b=2)
    with pytest.raises(FormulaError, match="did you mean scale"):
        parse("scael x", {"scale": sympy.Integer(2)})


def test_min_max_and_abs_are_kept_as_written():
    f = parse("max(abs(x), min(y, -z), abs(abs(x)))^2 - sqrt(max(x, y))")
    assert f.count(sympy.Max) == 2 and f.count(sympy.Abs) == 3


def test_nothing_is_run_as_python():
    for text in ("__import__('os')", "x.__class__", "lambda x: x", "().__class__", "exec(x)", "x if y else z"):
        with pytest.raises(FormulaError):
            parse(text)


leaves = st.sampled_from(["x", "y", "z", "2", "0.5", "3"])
formulas = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        st.tuples(inner, st.sampled_from("23")).map(lambda t: f"({t[0]})^{t[1]}"),
        st.tuples(st.sampled_from(["sin", "cos", "exp", "abs"]), inner).map(lambda t: f"{t[0]}({t[1]})"),
        st.tuples(inner, inner).map(lambda t: f"max({t[0]}, {t[1]})"),
    ),
    max_leaves=8,
)


@given(formulas)
@settings(max_examples=60, deadline=None)
def test_agrees_with_python_and_with_its_own_printing(text):
    f = parse(text)
    place = {"x": 0.3, "y": -0.7, "z": 1.1}
    import math

    names = {"sin": math.sin, "cos": math.cos, "exp": math.exp, "abs": abs, "max": max, **place}
    try:
        wanted = eval(text.replace("^", "**"), {"__builtins__": {}}, names)  # the test's own text
    except OverflowError:
        return
    for g in (f, parse(write(f))):
        value = float(g.subs({x: place["x"], y: place["y"], z: place["z"]}).evalf(20))
        assert value == pytest.approx(wanted, rel=1e-9, abs=1e-9)


def test_long_formulas_are_read_in_time():
    assert len(parse(" + ".join(f"x^{n}" for n in range(1, 2000))).args) == 1999
