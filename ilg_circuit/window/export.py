"""The tab of files to take away: of the fit, of the strip as it is now, of its run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import panel as pn

import ilg_circuit as ilg

from ..browser.page import KINDS
from ..errors import InputError
from ..provenance import Provenance
from ..report.page import write_page
from .answers import box
from .download import Download
from .look import shown
from .session import Session
from .strip import StripTab


class ExportTab:
    """The tab: ``view`` is what Panel shows."""

    def __init__(self, session: Session, strip: StripTab) -> None:
        self.session, self.strip = session, strip
        self.told = shown()
        groups = {
            "The fit": [
                Download("Fitted strip (fitted.toml)", "fitted.toml", lambda path: self._fit().save(path)),
                Download("Report (report.html)", "report.html", self._report),
                Download("All numbers of the fit (fit.json)", "fit.json", lambda path: self._fit().save(path)),
            ],
            "The strip as its sliders stand": [
                Download("Strip (strip.toml)", "strip.toml", lambda path: session.strip.save(path)),
                Download(
                    "Library for SPICE (strip.lib)", "strip.lib", lambda path: ilg.library(session.strip).save(path)
                ),
                Download("Deck of this run (strip.cir)", "strip.cir", self._deck),
                Download("Page with sliders for any browser (strip.html)", "strip.html", self._page),
            ],
            "Its run": [
                Download("Waveforms (response.csv)", "response.csv", lambda path: self._run().save(path)),
                Download("Picture (response.png)", "response.png", lambda path: self._run().save(path)),
            ],
        }
        self.files = {each.name: each for group in groups.values() for each in group}
        wide = {"flex": "1 1 min(280px, 100%)", "min-width": "0"}
        columns = [
            pn.Column(shown(f"<h2>{title}</h2>"), *(each.view for each in group), styles=wide)
            for title, group in groups.items()
        ]
        self.view = pn.Column(
            self.told,
            pn.FlexBox(*columns, flex_wrap="wrap", align_items="flex-start", sizing_mode="stretch_width"),
            sizing_mode="stretch_width",
        )
        for what in ("base", "strip", "fit"):
            session.on(what, self._state)
        self._state()

    def _state(self) -> None:
        moved = "" if self.session.strip is self.session.base else ", with sliders moved"
        fitted = self.session.fit is not None
        lines = [f"Strip: {self.session.base.name}, {self.session.origin}{moved}."]
        self.told.object = box("note", *lines, *([] if fitted else ["There is no fit yet; its files need one."]))
        for name in ("fitted.toml", "report.html", "fit.json"):
            self.files[name].button.disabled = not fitted

    def _fit(self) -> Any:
        if self.session.fit is None:
            raise InputError("there is no fit yet; fit a measurement in the first tab")
        return self.session.fit.result

    def _report(self, path: Path) -> None:
        result = self._fit()
        write_page(result.page(), path, result.provenance)

    def _run(self) -> Any:
        if self.session.run is None:
            raise InputError("there is no run yet; choose a drive in the tab Strip")
        return self.session.run

    def _deck(self, path: Path) -> None:
        drive, duration, tip, load = self.strip.asked()
        ilg.netlist(self.session.strip, drive, duration, tip=tip, load=load or None).save(path)

    def _page(self, path: Path) -> None:
        drive, duration, _, _ = self.strip.asked()
        if drive.partition(":")[0] not in KINDS:  # a page has only these; another one is begun with the default
            drive, duration = "step:4V", "300 s"
        ilg.page(self.session.strip, path, drive, duration, origin=Provenance(call="ilg-circuit app"))
