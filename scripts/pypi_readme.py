"""Writes the README as PyPI shows it, where no link may be relative; builds call it (hatch_build.py).

python scripts/pypi_readme.py https://example.org/repository v1.0.0
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

#: The target of a link or picture of Markdown, or of an attribute of HTML; what stands before it tells pictures.
_TARGET = re.compile(
    r"(?P<before>(?P<picture>!?)\[(?:!\[[^\]]*\]\([^)]*\)|[^\[\]])*\]\()(?P<target>[^)\s]+)"
    r"|(?P<html>\b(?P<attribute>src|srcset|href)=\")(?P<path>[^\"]+)"
    r"|(?P<label>^\[[^\]]+\]:\s+)(?P<place>\S+)",
    flags=re.MULTILINE,
)
_PICTURE = re.compile(r"\.(svg|png|gif|jpe?g|webp)$", flags=re.IGNORECASE)
_CODE = re.compile(r"(^```.*?^```[^\n]*$|`[^`\n]+`)", flags=re.MULTILINE | re.DOTALL)


def absolute(text: str, repository: str, tag: str) -> str:
    """Return Markdown whose relative links and pictures are those of a tag of the repository; code is left alone.

    Pictures are linked as they are (raw), all else as the repository shows it; a place within the text stays.
    """

    def there(path: str) -> str:
        if re.match(r"[a-z][a-z0-9+.-]*:|//|#", path, flags=re.IGNORECASE):
            return path
        name = path.removeprefix("./").lstrip("/")
        way = "raw" if _PICTURE.search(name.split("#")[0]) else "blob"
        return f"{repository}/{way}/{tag}/{name}"

    def replaced(found: re.Match[str]) -> str:
        before = found["before"] or found["html"] or found["label"]
        if found["before"] and "](" in (inner := before[1:-2]):  # a picture that is a link: [![text](picture)](page)
            before = f"[{_TARGET.sub(replaced, inner)}]("
        return before + there(found["target"] or found["path"] or found["place"])

    # code in a link's text, as in [`a`](b), is within the link: pieces of code are hidden, then put back
    codes: list[str] = []

    def hidden(found: re.Match[str]) -> str:
        codes.append(found[0])
        return f"\0{len(codes) - 1}\0"

    linked = _TARGET.sub(replaced, _CODE.sub(hidden, text))
    return re.sub(r"\0(\d+)\0", lambda found: codes[int(found[1])], linked)


if __name__ == "__main__":
    print(absolute((Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8"), *sys.argv[1:3]))
