"""Help names what there is: forms of drives, outputs, models and their parameters, as the registries have them."""

from __future__ import annotations

import re
from inspect import getdoc

import click
import pytest

import ilg_circuit as ilg
from ilg_circuit.commands.sweep import sweep
from ilg_circuit.simulation.drives import CURRENT, FORMS
from ilg_circuit.simulation.waveforms import WAVEFORMS
from ilg_circuit.strip.models.registry import ADDITIONS, MODELS, electrical_model
from ilg_circuit.strip.plausible import USUAL
from ilg_circuit.study.outputs import OUTPUTS
from ilg_circuit.study.pareto import POINTS


def rows(function: object) -> dict[str, str]:
    """The tables in a function's help: first cell -> the rest, on one line."""
    found: dict[str, str] = {}
    inside, name = False, ""
    for line in str(getdoc(function)).splitlines():
        if re.fullmatch(r"=+( +=+)+", line):
            inside = not inside
        elif inside and not line.startswith(" "):
            name, _, rest = line.partition("  ")
            found[name] = " ".join(rest.split())
        elif inside:
            found[name] += f" {line.strip()}"
    return found


def test_simulate_lists_the_forms_of_drives_and_the_waveforms() -> None:
    assert rows(ilg.simulate) == {f"``{form.examples[0].split(', ')[0]}``": form.meaning for form in (*FORMS, CURRENT)}
    assert all(
        f"``{name}`` [{wave.unit}]" in " ".join(str(getdoc(ilg.simulate)).split()) for name, wave in WAVEFORMS.items()
    )


def test_sweep_lists_the_outputs_with_their_units() -> None:
    assert rows(ilg.sweep) == {name: f"{output.unit or '1'} {output.meaning}" for name, output in OUTPUTS.items()}


@pytest.mark.parametrize("model", [*MODELS, *ADDITIONS])
def test_identify_lists_the_parameters_of_each_model(model: str) -> None:
    common = str(getdoc(ilg.identify)).partition("====")[0]
    cells = next(cells for names, cells in rows(ilg.identify).items() if model in re.split(r", |\+", names))
    known = {p.name for p in electrical_model("rc").parameters} if model in ADDITIONS else set()
    for parameter in electrical_model(f"rc+{model}" if model in ADDITIONS else model).parameters:
        if parameter.name not in known and parameter.name not in common:
            assert parameter.name in cells
            assert not parameter.unit or f"[{parameter.unit}]" in cells


def test_the_command_sweep_names_every_output() -> None:
    (text,) = (option.help for option in sweep.params if option.name == "outputs" and isinstance(option, click.Option))
    for name in OUTPUTS:
        waveform, _, ending = name.rpartition("_")
        assert name in str(text) or (waveform in str(text) and f"_{ending}" in str(text))


def test_defaults_and_names_in_sentences() -> None:
    for function in (ilg.design, ilg.pareto):
        assert f"default: {POINTS[2]} for two objectives, {POINTS[3]} for three" in str(function.__doc__)
    assert all(name in str(ilg.sweep.__doc__) for name in USUAL)
