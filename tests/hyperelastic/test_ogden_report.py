"""What is told of a hyperelastic fit, the files it reads, and the command that makes it."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np
import pytest
from gels import TWO, readings

from ilg_circuit.cli import main
from ilg_circuit.errors import InputError
from ilg_circuit.hyperelastic import MODES, Characterisation, LoadTest, Ogden, characterise, fit_model, read_load_test
from ilg_circuit.hyperelastic.estimates import derived, parameters
from ilg_circuit.report.axes import save
from ilg_circuit.report.ogden import write_actuator
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import load_actuator

# -- report ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def result() -> Characterisation:
    return characterise(readings(TWO, noise=0.01), terms=2)


def test_parameters_have_errors_and_intervals_of_their_sign(result: Characterisation) -> None:
    for name, p in parameters(result.fit).items():
        assert p.stderr is not None
        assert p.stderr > 0
        assert p.ci95 is not None
        assert p.ci95[0] < p.value < p.ci95[1]
        if name.startswith("mu"):
            assert p.ci95[0] * p.ci95[1] > 0
    more = derived(result.fit)
    assert more["youngs_modulus"].value == pytest.approx(3 * more["shear_modulus"].value)
    assert more["mu_1_other_convention"].value == pytest.approx(result.material.moduli[0])


def test_held_parameters_say_so() -> None:
    fit = fit_model(readings(TWO, noise=0.01), "mooney-rivlin")
    found = parameters(fit)
    assert found["alpha_2"].fixed_because == "Mooney-Rivlin by definition"
    assert found["alpha_2"].stderr is None
    again = Ogden.mooney_rivlin(derived(fit)["c10"].value, derived(fit)["c01"].value)
    assert again.mu == pytest.approx(fit.material.mu)


def test_json_is_json_even_where_nothing_is_determined(result: Characterisation) -> None:
    told = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert "mu_i/alpha_i (l1" in told["convention"]
    assert "2 mu_i/alpha_i^2" in told["other_convention"]
    assert set(told["statistics"]["tests"]) == set(MODES)
    hopeless = characterise(readings(Ogden.neo_hookean(1e3), "planar"), model="mooney-rivlin")
    told = json.loads(json.dumps(hopeless.to_dict(), allow_nan=False))
    assert told["parameters"]["mu_1"]["stderr"] is None
    assert told["predictions"][0]["stderr"] is None
    assert told["correlations"] == {}
    assert "undetermined" in hopeless.summary()


def test_table_names_both_conventions(result: Characterisation) -> None:
    text = result.summary()
    assert "convention: W = sum mu_i/alpha_i (" in text
    assert "other convention: W = sum 2 mu_i/alpha_i^2 (" in text
    for word in ("shear_modulus", "youngs_modulus", "AIC", "BIC", "uniaxial", "equibiaxial", "planar", "Cauchy"):
        assert word in text


@pytest.mark.parametrize("modes", [(), ("uniaxial",)], ids=["joint", "uniaxial"])
def test_picture(tmp_path: Path, modes: tuple[str, ...]) -> None:
    import matplotlib

    with matplotlib.rc_context({"svg.fonttype": "none"}):  # text as text
        save(characterise(readings(TWO, *modes, noise=0.01), terms=2).figure(), tmp_path / "fit.svg")
    text = (tmp_path / "fit.svg").read_text(encoding="utf-8")
    for label in ("nominal stress [kPa]", "stretch [1]", "data - fit [", "uniaxial, measured", "uniaxial, fit"):
        assert label in text
    assert ("planar, predicted" in text) == bool(modes)
    assert ("planar, measured" in text) != bool(modes)
    assert ("beyond the readings" in text) != bool(modes)


def test_the_modulus_goes_into_an_actuator(result: Characterisation, tmp_path: Path) -> None:
    write_actuator(result, PAPER, tmp_path / "fitted.toml")
    found = load_actuator(tmp_path / "fitted.toml")
    modulus = result.material.youngs_modulus
    assert found == replace(PAPER, material=replace(PAPER.material, youngs_modulus=modulus))
    assert "# youngs_modulus = 3 G fitted by" in (tmp_path / "fitted.toml").read_text()


def test_no_actuator_of_negative_modulus(tmp_path: Path) -> None:
    nonsense = Ogden.from_moduli([2000.0, -3000.0], [3.0, -2.0])
    stretch = np.linspace(2.0, 4, 20)
    test = LoadTest("uniaxial", stretch, nonsense.nominal("uniaxial", stretch))
    result = characterise([test], terms=2, constrained=False)
    assert result.material.shear_modulus < 0
    assert any("it must be positive" in line for line in result.warnings)
    with pytest.raises(InputError, match="which no strip has"):
        write_actuator(result, PAPER, tmp_path / "fitted.toml")
    assert list(tmp_path.iterdir()) == []


# -- files -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "stretch,stress_kPa\n1.0,0\n1.1,2\n1.5,7\n",
        "stress_Pa,stretch\n0,1\n2000,1.1\n7000,1.5\n",
        "Stretch;Stress [kPa]\n1,1;2,0\n1,5;7,0\n",
        "stress_kPa stretch\n  2.0   1.1\r\n  7.0   1.5\r\n",
        "stretch, stress_kPa\n1.1 2.0\n1.5 7.0\n",
        "stretch [-],nominal stress (kPa)\n1.1,2\n,3\n1.2,\n1.5,7\n",
        "stretch_%\tengineering_stress_MPa\n110\t0.002\n150\t0.007\n",
        "stretch_ratio,true_stress_kPa\n1.1,2.2\n1.5,10.5\n",
        "lambda,cauchy_stress_kPa,note\n1.1,2.2,a\n1.5,10.5,b\n",
    ],
    ids=["csv", "order", "semicolons", "spaces", "mixed", "gaps", "percent", "true", "cauchy"],
)
def test_files(tmp_path: Path, text: str) -> None:
    path = tmp_path / "data.csv"
    path.write_bytes(text.encode())
    test = read_load_test(path, "uniaxial")
    assert test.stretch == pytest.approx([1.1, 1.5])
    assert test.stress == pytest.approx([2000.0, 7000.0])
    assert test.source == "data.csv"


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("0.1 1.1\n0.2 1.2\n", "no column for stretch: the first row holds numbers, not names; put a row of names"),
        ("stretch,stress\n1.1,2\n", "column 'stress' has no unit; write it like 'stress_Pa'"),
        ("stretch_mm,stress_Pa\n1.1,2\n", "unit 'mm' does not measure a pure number; leave it out"),
        ("stretch,stress_V\n1.1,2\n", "unit 'V' does not measure"),
        (
            "deformazione_%,stress_Pa\n10,2\n",
            "no column for stretch; not understood: 'deformazione_%'; .* like stretch, stress_MPa",
        ),
        ("stretch,force_N\n1.1,2\n", "its column 'force_N' is a force; give .* section='10mm"),
        ("stretch,stress_Pa,true_stress_Pa\n1.1,2,2.2\n", "a nominal and a true stress; leave one out"),
        ("stretch,stress_Pa\n,2\n1.1,\n", "no row has both"),
        ("stretch,true_stress_Pa\n0,2\n1.1,2\n", "stretch 0"),
        ("stretch,stress_Pa\n-1,2\n1.1,2\n", "stretch -1"),
        ("", "the file is empty; it needs a header row such as stretch, stress_MPa"),
    ],
)
def test_files_that_are_refused(tmp_path: Path, text: str, hint: str) -> None:
    path = tmp_path / "data.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=r"data\.csv: .*" + hint.replace("(", r"\(")):
        read_load_test(path, "uniaxial")


# -- command -----------------------------------------------------------------------------------------------------------

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """`ilg-circuit ogden` in this process, in a folder with one file for each test."""
    monkeypatch.chdir(tmp_path)
    for test in readings(TWO, noise=0.005):
        rows = "".join(f"{a!r},{b / 1e3!r}\n" for a, b in zip(test.stretch.tolist(), test.stress.tolist(), strict=True))
        Path(f"{test.mode}.csv").write_text(f"stretch,stress_kPa\n{rows}")

    def call(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as caught:
            main(["ogden", *arguments])
        streams = capsys.readouterr()
        return int(caught.value.code or 0), streams.out, streams.err

    return call


ALL = ("--uniaxial", "uniaxial.csv", "--equibiaxial", "equibiaxial.csv", "--planar", "planar.csv")


def test_command(run: Run) -> None:
    code, out, err = run(*ALL, "--terms", "2")
    assert code == 0
    assert err == ""
    assert "uniaxial.csv (uniaxial), equibiaxial.csv (equibiaxial), planar.csv (planar): Ogden with 2 terms" in out


def test_command_json(run: Run, tmp_path: Path) -> None:
    before = sorted(tmp_path.iterdir())
    code, out, err = run(*ALL, "--json", "--at", "2")
    told = json.loads(out)
    assert code == 0
    assert err == ""
    assert told["model"] == "ogden"
    assert told["terms"] == 2
    assert told["derived"]["youngs_modulus"]["value"] == pytest.approx(TWO.youngs_modulus, rel=0.05)
    assert told["derived"]["youngs_modulus"]["unit"] == "Pa"
    assert {p["stretch"] for p in told["predictions"]} == {2.0}
    assert sorted(tmp_path.iterdir()) == before  # nothing is written unasked


def test_command_warns_on_stderr_and_in_json(run: Run) -> None:
    code, out, err = run("--uniaxial", "uniaxial.csv", "--json")
    assert code == 0
    told = json.loads(out)["warnings"]
    assert [f"warning: {line}" for line in told] == err.splitlines()
    assert "it predicts" in told[0]
    assert "equibiaxial" in told[0]


def test_command_writes_what_is_asked(run: Run) -> None:
    code, _, err = run(
        *ALL, "--actuator", "paper", "--out", "fitted.toml", "--plot", "fit.png", "--weights", "relative"
    )
    assert code == 0, err
    assert Path("fit.png").read_bytes().startswith(b"\x89PNG")
    modulus = tomllib.loads(Path("fitted.toml").read_text())["material"]["youngs_modulus"]
    assert float(modulus.split()[0]) == pytest.approx(TWO.youngs_modulus / 1e3, rel=0.05)


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        ((), "no test was given; give at least one of --uniaxial, --equibiaxial, --planar"),
        ((*ALL, "--terms", "0"), "terms is 0; an Ogden fit has 1 to 4"),
        ((*ALL, "--terms", "5"), "terms is 5"),
        ((*ALL, "--terms", "two"), "--terms"),
        ((*ALL, "--model", "yeoh"), "'neo-hookean'"),
        (("--uniaxial", "none.csv"), "cannot read 'none.csv'"),
        ((*ALL, "--out", "fitted.toml"), "--out without --actuator"),
        ((*ALL, "--actuator", "paper"), "--actuator without --out"),
        ((*ALL, "--actuator", "pper", "--out", "fitted.toml"), "no actuator 'pper'"),
        ((*ALL, "--plot", "fit.gif"), "end its name in .png, .pdf or .svg"),
        ((*ALL, "--actuator", "paper", "--out", "none/fitted.toml"), "does not exist"),
        ((*ALL, "--actuator", "paper", "--out", "planar.csv"), "name the same file"),
        (("--uniaxial", "planar.csv", "--planar", "planar.csv"), "name the same file"),
        ((*ALL, "--at", "0"), "stretch 0 to predict at"),
        ((*ALL, "--at", "nan"), "'nan' is not a number"),
    ],
)
def test_command_refuses_in_one_line(run: Run, tmp_path: Path, arguments: tuple[str, ...], hint: str) -> None:
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    code, out, err = run(*arguments)
    assert code == 2
    assert out == ""
    assert len(err.splitlines()) == 1
    assert err.startswith("ilg-circuit: ")
    assert hint in err
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_one_page_holds_all_of_it(run: Run) -> None:
    code, _, err = run("--uniaxial", "uniaxial.csv", "--terms", "2", "--report", "r.html")
    assert code == 0, err
    page = Path("r.html").read_text(encoding="utf-8")
    for name in ("mu_1", "alpha_2", "youngs_modulus", "mu_2_other_convention", "extrapolated"):
        assert name in page
    assert page.count("data:image/png;base64,") == 1
    for line in err.splitlines():
        assert escape(line.removeprefix("warning: "), quote=False) in page.replace("&#39;", "'").replace("&#34;", '"')
