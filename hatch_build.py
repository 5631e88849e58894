"""What a build adds: the page's ngspice where npm is there, links that work on PyPI, the project's addresses.

With ILG_CARRY_NGSPICE=1 a wheel carries Debian's libngspice for systems that have none, with its licences, and is for
this kind of processor and Linux only; without it a wheel is for every system.
"""

from __future__ import annotations

import os
import platform
import runpy
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface


class BuildHook(BuildHookInterface[Any]):
    """Fetches the files of `ilg-circuit page`, without which a build goes on, and the library if it is asked for."""

    PLUGIN_NAME = "custom"
    _carried: str | None = None

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
        if self.target_name == "wheel" and os.environ.get("ILG_CARRY_NGSPICE") == "1":
            self._carry(build_data)

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what was unpacked for the wheel."""
        if self._carried:
            shutil.rmtree(self._carried, ignore_errors=True)

    def _carry(self, build_data: dict[str, Any]) -> None:
        self._carried = tempfile.mkdtemp()
        script = runpy.run_path(str(Path(self.root) / "scripts" / "debian_packages.py"))
        try:
            major, minor = script["carry"](Path(self._carried))
        except (OSError, subprocess.CalledProcessError) as error:
            raise SystemExit(f"ngspice: cannot get Debian's package: {script['last_line'](error)}") from None
        build_data["force_include"][self._carried] = "ilg_circuit/solve/carried"
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-manylinux_{major}_{minor}_{platform.machine()}"
        self.app.display_info(f"ngspice: carried, for glibc {major}.{minor} and later")


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
