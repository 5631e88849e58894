"""Puts ngspice for the browser into wheels and source distributions where npm is there to fetch it."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PageAssets(BuildHookInterface[Any]):
    """Fetches the files of `ilg-circuit page`; a build without npm goes on without them."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Fetch them before a build; an editable install leaves that to `make setup`."""
        if version == "editable":
            return
        script = runpy.run_path(str(Path(self.root) / "scripts" / "get_page_assets.py"))
        try:
            self.app.display_info(f"page: {script['get']()}")
        except script["Missing"] as error:
            self.app.display_warning(f"page: {error}; this build has no ilg-circuit page")
