"""How a window looks: its style sheets, and the arrangements that all tabs share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import panel as pn

#: Style sheet of what results show; a pane has its own, as nothing else reaches into it.
ANSWER = Path(__file__).with_name("answer.css").read_text(encoding="utf-8")
#: The left part of a tab, the right part, and both.
_LEFT = {"flex": "1 1 300px", "max-width": "420px", "min-width": "0"}
_RIGHT = {"flex": "3 1 min(520px, 100%)", "min-width": "0"}
_BOTH = {"gap": "1.2rem", "width": "100%"}


def shown(html: str = "", **settings: Any) -> Any:
    """Return a pane for HTML of this package."""
    return pn.pane.HTML(html, stylesheets=[ANSWER], sizing_mode="stretch_width", margin=(2, 5), **settings)


def parts(left: list[Any], right: list[Any]) -> Any:
    """Return a tab: what is asked for on the left, the answer on the right, beneath it on a narrow screen."""
    return pn.FlexBox(
        pn.Column(*left, sizing_mode="stretch_width", styles=_LEFT),
        pn.Column(*right, sizing_mode="stretch_width", styles=_RIGHT),
        flex_wrap="wrap",
        align_items="flex-start",
        styles=_BOTH,
        sizing_mode="stretch_width",
    )


def tabs(*pairs: tuple[str, Any]) -> Any:
    """Return tabs of which only the one that is seen takes room."""
    for k, (_, view) in enumerate(pairs):
        view.visible = k == 0
    made = pn.Tabs(*pairs, sizing_mode="stretch_width", margin=0)
    views = {f"view_{k}": view for k, (_, view) in enumerate(pairs)}
    hidden = "; ".join(f"view_{k}.visible = cb_obj.active == {k}" for k in range(len(pairs)))
    made.jscallback(args=views, active=hidden)
    return made


def field(name: str, value: str = "", placeholder: str = "", help: str = "") -> Any:
    """Return a field for a text."""
    return pn.widgets.TextInput(
        label=name, value=value, placeholder=placeholder, description=help or None, sizing_mode="stretch_width"
    )


def lines(name: str, value: str = "", placeholder: str = "", rows: int = 2, help: str = "") -> Any:
    """Return a field for several entries, one a line."""
    return pn.widgets.TextAreaInput(
        label=name,
        value=value,
        placeholder=placeholder,
        rows=rows,
        description=help or None,
        sizing_mode="stretch_width",
    )


def choice(name: str, options: Any, value: Any = None, help: str = "", **settings: Any) -> Any:
    """Return a list to choose one from."""
    chosen = {} if value is None else {"value": value}
    return pn.widgets.Select(
        label=name, options=options, description=help or None, sizing_mode="stretch_width", **chosen, **settings
    )


def button(name: str, clicked: Callable[[], object], *, first: bool = False) -> Any:
    """Return a button; the ``first`` one of a tab is the one to press."""
    made = pn.widgets.Button(label=name, color="primary" if first else "default", sizing_mode="stretch_width")
    made.on_click(lambda _event: clicked())
    return made


def card(title: str, *content: Any, open: bool = False) -> Any:
    """Return a part that can be folded."""
    return pn.Card(*content, title=title, collapsed=not open, sizing_mode="stretch_width", margin=(5, 5))
