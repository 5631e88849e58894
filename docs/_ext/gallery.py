"""The gallery: its order, its pictures with alternative texts, and a folder of its own to run in."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx_gallery.scrapers import matplotlib_scraper

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
#: Examples from the first simulation to the arm.
ORDER = (
    "load_a_strip",
    "simulate_and_plot",
    "drives_by_name",
    "drive_by_current",
    "two_engines_agree",
    "impedance_spectrum",
    "strip_as_a_sensor",
    "shape_of_a_strip",
    "loads_and_energy",
    "gravity",
    "segmented_strip",
    "fit_a_dataframe",
    "fit_a_spectrum",
    "response_of_a_chirp",
    "sheets_from_spectra",
    "two_clocks",
    "several_files",
    "choose_a_model",
    "nonlinear_strip",
    "motion_follows_charge",
    "outliers_by_name",
    "parameters_and_errors",
    "profile_and_mcmc",
    "how_long_to_record",
    "prediction_with_a_band",
    "sweep_strips",
    "map_of_a_sweep",
    "thinner_strip",
    "design_a_strip",
    "pareto_front",
    "tune_a_controller",
    "neglected_beam",
    "follow_a_path",
    "shape_by_segments",
    "learn_over_trials",
    "close_the_loop",
    "drying_strip",
    "netlists",
    "own_driver",
    "own_model",
    "youngs_modulus",
    "rhythm",
    "feel_the_strip",
    "soft_arm",
    "interactive_page",
)
#: What a picture shows, for those who do not see it: in the cell that draws it.
_ALT = re.compile(r'^# sphinx_gallery_alt = "(.+)"$', re.MULTILINE)


def example_order(file: str) -> int:
    """Return the place of an example. Raises ExtensionError for one that is not in `ORDER`."""
    name = Path(file).stem
    if name not in ORDER:
        raise ExtensionError(f"{file}: give the example its place in ORDER of docs/_ext/gallery.py")
    return ORDER.index(name)


def pictures(block: Any, block_vars: dict[str, Any], gallery_conf: Any, **settings: Any) -> str:
    """Return the pictures of a cell with the text that its comment gives. Raises ExtensionError where it has none."""
    made: str = matplotlib_scraper(block, block_vars, gallery_conf, bbox_inches="tight", **settings)
    if not made:
        return ""
    text = _ALT.search(block.content)
    if text is None:
        raise ExtensionError(f'{block_vars["src_file"]}: a picture without # sphinx_gallery_alt = "what it shows"')
    return re.sub(r":alt:.*", lambda _: f":alt: {text[1]}", made)


def copy_examples(into: Path) -> Path:
    """Copy the examples into a folder, where they may leave files, and return it."""
    shutil.rmtree(into, ignore_errors=True)
    into.mkdir(parents=True)
    for file in (*EXAMPLES.glob("*.py"), EXAMPLES / "GALLERY_HEADER.rst"):
        shutil.copy(file, into)
    return into


def setup(app: Sphinx) -> dict[str, bool]:
    """Copy the examples to where conf.py has the gallery look for them, before it does."""
    copy_examples(Path(app.srcdir) / "_build" / "examples")
    return {"parallel_read_safe": True, "parallel_write_safe": True}
