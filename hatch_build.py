"""What a build adds: the page's ngspice where npm is there, links that work on PyPI, the project's addresses."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface


class BuildHook(BuildHookInterface[Any]):
    """Fetches the files of `ilg-circuit page`; a build without npm goes on without them."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Fetch them before a build; an editable install leaves that to `make setup`."""
        if version == "editable":
            return
        if ".invalid/" in self.metadata.core.urls["Repository"]:
            self.app.display_warning("links: the repository's address in pyproject.toml is a placeholder")
        script = runpy.run_path(str(Path(self.root) / "scripts" / "get_page_assets.py"))
        try:
            self.app.display_info(f"page: {script['get']()}")
        except script["Missing"] as error:
            self.app.display_warning(f"page: {error}; this build has no ilg-circuit page")


class Links(MetadataHookInterface):
    """Gives the project its addresses, and its README for PyPI, where no link may be relative."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, Any]) -> None:
        """Write ``readme`` and ``urls`` from the repository's address."""
        repository, tag = self.config["repository"], f"v{metadata['version']}"
        absolute = runpy.run_path(str(Path(self.root) / "scripts" / "pypi_readme.py"))["absolute"]
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": absolute(text, repository, tag)}
        metadata["urls"] = {
            "Homepage": repository,
            "Documentation": f"{repository}/tree/{tag}/docs",
            "Repository": repository,
            "Issues": f"{repository}/issues",
            "Changelog": f"{repository}/blob/{tag}/CHANGELOG.md",
        }
