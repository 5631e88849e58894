"""The base class of results: plain data; text, pictures, tables and files are made on demand."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar, Self

from .errors import InputError
from .extras import require_dataframe, require_netcdf, whole
from .files import write_csv, writing_netcdf
from .provenance import Provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray
    from pandas import DataFrame
    from xarray import Dataset

    from .report.page import Page

#: Methods that users of other libraries look for, and what a result has in place of them.
_INSTEAD = {
    "to_csv": 'save("x.csv")',
    "to_json": 'save("x.json"), or .to_dict()',
    "to_netcdf": 'save("x.nc"), or .to_xarray()',
    "to_excel": 'to_dataframe().to_excel("x.xlsx")',
    "to_pandas": "to_dataframe()",
    "savefig": 'save("x.png")',
}


@dataclass(frozen=True)
class Column:
    """A column of a result's table: ``values`` (n,) in ``unit``, "" for a ratio or a count, None for words.

    The unit is None too where it differs from row to row. ``over`` marks the abscissa, such as
    time.
    """

    name: str
    values: Iterable[Any]
    unit: str | None = None
    over: bool = False

    @property
    def header(self) -> str:
        """Its header in a CSV file, such as current_A."""
        return f"{self.name}_{self.unit}" if self.unit else self.name


@dataclass(frozen=True)
class Curve:
    """What was measured of a ``quantity`` [``unit``] in ``source`` and its fit, both (n,), over an abscissa ``x``."""

    quantity: str
    unit: str
    source: str
    x: Column
    measured: NDArray[Any]
    fitted: NDArray[Any]

    def add_to(self, data: Dataset, number: int) -> None:
        """Add its variables to ``data``, their names ending in ``number``; complex ones as real and imaginary part."""
        over, unit = f"{self.x.name}_{number}", self.unit or "1"
        data[over] = (over, self.x.values, {"units": self.x.unit or "1"})
        parts = {"re_": "real", "im_": "imag"} if self.measured.dtype.kind == "c" else {"": "real"}
        for what, values in (("", self.measured), ("_fit", self.fitted)):
            for start, part in parts.items():
                attributes = {"units": unit, "source": self.source}
                data[f"{start}{self.quantity}{what}_{number}"] = (over, getattr(values, part), attributes)


@dataclass(frozen=True, repr=False, eq=False)
class Result:
    """The base class of what a command or a function of the front door returns; ``provenance`` is its origin.

    A subclass names in ``presenter`` the module of `ilg_circuit.report` that shows it: its functions ``headline``,
    ``facts``, ``panels``, ``summary``, ``figure`` and, for more than `report.doors` makes of these, ``page`` take the
    result.
    """

    presenter: ClassVar[str]
    provenance: Provenance = field(default_factory=Provenance, kw_only=True, compare=False, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data, ready for JSON.

        Returns
        -------
        dict
            Numbers in SI units, texts, lists and dictionaries.
        """
        raise NotImplementedError(f"{type(self).__name__}.to_dict")

    def table(self) -> tuple[Column, ...]:
        """Return the result as columns of one length."""
        raise NotImplementedError(f"{type(self).__name__}.table")

    def curves(self) -> Iterable[Curve]:
        """Return what was measured and fitted, for `to_xarray`; nothing where nothing was measured."""
        return ()

    def with_provenance(self, provenance: Provenance) -> Self:
        """Return the result with another provenance."""
        return replace(self, provenance=provenance)

    def columns(self) -> dict[str, Any]:
        """Return the table as a mapping of headers, as in a CSV file, to values.

        Returns
        -------
        dict of str to sequence
            Header, such as current_A -> values (n,).
        """
        return {column.header: column.values for column in self.table()}

    def to_dataframe(self) -> DataFrame:
        """Return the result's table as a pandas DataFrame, whose columns have the names of a CSV file.

        Returns
        -------
        pandas.DataFrame
            One row per sample, frequency, parameter or design. Names of columns end in the SI unit, as in current_A.

        Raises
        ------
        MissingLibraryError
            pandas is not installed; it comes with the extra ``dataframe``.

        Examples
        --------
        >>> from ilg_circuit.simulation.drives import parse_drive
        >>> from ilg_circuit.simulation.response import simulate
        >>> from ilg_circuit.strip.actuator import PAPER
        >>> response = simulate(PAPER, parse_drive("step:4V", 300.0), [0.0, 150.0, 300.0], engine="exact")
        >>> response.to_dataframe()[["time_s", "voltage_V", "current_A"]].round(4)
           time_s  voltage_V  current_A
        0     0.0        4.0     0.2118
        1   150.0        4.0     0.0060
        2   300.0        4.0     0.0060
        """
        require_dataframe("pandas")
        from pandas import DataFrame

        return DataFrame(self.columns())

    def to_xarray(self) -> Dataset:
        """Return the result's table as an xarray Dataset: one variable a column, with its unit in ``attrs["units"]``.

        For a fit the dataset also holds the curves: the measured and the fitted values of each file, over a dimension
        of its own.

        Returns
        -------
        xarray.Dataset
            Variables over time, frequency or another abscissa, or over the number of the row; SI units.

        Raises
        ------
        MissingLibraryError
            xarray is not installed; it comes with the extra ``dataframe``.

        Examples
        --------
        >>> import numpy as np
        >>> from ilg_circuit.simulation.impedance import impedance
        >>> from ilg_circuit.strip.actuator import PAPER
        >>> data = impedance(PAPER, np.geomspace(0.001, 1, 4), engine="exact").to_xarray()
        >>> data["re"].dims, data["re"].attrs["units"], round(float(data["re"].sel(frequency=1.0)), 2)
        (('frequency',), 'ohm', 18.89)
        """
        require_dataframe("xarray")
        import numpy as np
        from xarray import Dataset

        columns = self.table()
        over = next((column.name for column in columns if column.over), "row")
        values = {column.name: np.asarray([np.nan if x is None else x for x in column.values]) for column in columns}
        units = {c.name: {} if c.unit is None else {"units": c.unit or "1"} for c in columns}
        data = {name: (over, column, units[name]) for name, column in values.items()}
        if over == "row":
            data["row"] = ("row", np.arange(len(next(iter(values.values())))), {"units": "1"})
        coordinate = {over: data.pop(over)}
        about = {"title": self._shown("headline"), "provenance": json.dumps(self.provenance.to_dict())}
        whole = Dataset(data, coords=coordinate, attrs=about)
        for number, curve in enumerate(self.curves(), 1):
            curve.add_to(whole, number)
        return whole

    def save(self, path: str | Path, *, size: Any = None, style: str | Path | None = None) -> None:
        """Write the result in the format of the suffix of ``path``. A file is replaced whole or not at all.

        Parameters
        ----------
        path : str or Path
            ``.csv`` (the table with full precision), ``.json`` (`to_dict` with the provenance), ``.png``, ``.pdf``,
            ``.svg`` (the picture), ``.html`` (the page), ``.nc`` (`to_xarray`), and ``.toml`` of a result that makes a
            strip. A fit of a strip is written as a folder with all of it, too: ``step.fit/``.
        size : str or pair of float, optional
            Size of a picture: "85mm", "85mm,60mm", or width and height [m].
        style : str or Path, optional
            Path of a matplotlib style file for a picture.

        Raises
        ------
        InputError
            The result cannot be written in the format of the suffix, or the file cannot be written.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> from ilg_circuit.oscillators.sweep import cpg_sweep
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     cpg_sweep("inhibition=2:3:2").save(Path(folder) / "rhythms.csv")
        ...     print((Path(folder) / "rhythms.csv").read_text().splitlines()[0])
        inhibition,oscillates,period_s,amplitude
        """
        from .report.look import chosen

        _doors().save(self, path, chosen(size, style))

    def write_csv(self, path: str | Path) -> None:
        """Write the columns as CSV with full precision, whatever the file's name ends in."""
        write_csv(path, self.columns())

    def write_netcdf(self, path: str | Path) -> None:
        """Write `to_xarray` as netCDF, whatever the file's name ends in."""
        require_netcdf()
        from xarray.backends import H5NetCDFStore

        with writing_netcdf(Path(path)) as file, self.to_xarray() as data:
            data.load().dump_to_store(H5NetCDFStore(file))

    def plot(
        self,
        *panel: Any,
        ax: Any = None,
        what: str | Sequence[str] = "",
        size: Any = None,
        style: str | Path | None = None,
        **curve: Any,
    ) -> Any:
        """Draw the result and return the axes; nothing is saved, and nothing shown before ``plt.show()``.

        Parameters
        ----------
        *panel : Axes, array of Axes, str or list of str
            ``ax`` or ``what``, or both, without their names: ``plot("current")``, ``plot(ax)``.
        ax : matplotlib.axes.Axes or array of these, optional
            Matplotlib axes on which one panel is drawn, or an array of axes, one for each panel. Left out, the whole
            picture is drawn through pyplot, as a notebook shows it.
        what : str or list of str
            Name of the panel, such as ``current`` of a response or ``bode`` of an impedance, or several names; the most
            telling one if left out, or as many as there are axes.
        size : str or pair of float, optional
            Size of the figure: "85mm", "85mm,60mm", or width and height [m].
        style : str or Path, optional
            Path of a matplotlib style file.
        **curve : Any
            Properties of the panel's main curve, such as ``color`` and ``label``.

        Returns
        -------
        matplotlib.axes.Axes or numpy.ndarray
            The axes, an array where there are several.

        Raises
        ------
        InputError
            There is no such panel or style, or nothing to draw.

        Examples
        --------
        >>> from matplotlib.figure import Figure
        >>> from ilg_circuit.simulation.drives import parse_drive
        >>> from ilg_circuit.simulation.response import simulate
        >>> from ilg_circuit.strip.actuator import PAPER
        >>> response = simulate(PAPER, parse_drive("step:4V", 300.0), [0.0, 150.0, 300.0], engine="exact")
        >>> axes = response.plot(ax=Figure().subplots(), what="current", color="black")
        >>> axes.get_xlabel(), axes.get_ylabel()
        ('time [s]', 'current [mA]')
        """
        for given in panel:
            named = isinstance(given, str) or (
                isinstance(given, list | tuple) and all(isinstance(x, str) for x in given)
            )
            if named and what == "":
                what = given
            elif not named and ax is None:
                ax = given
            else:
                raise InputError("plot takes axes (ax) and the name of a panel (what), each once")
        from .report.look import chosen

        return _doors().plot(self, ax, what, chosen(size, style), curve)

    def summary(self) -> str:
        """Return the result as text for a terminal.

        Returns
        -------
        str
            Lines with values, errors and units, and the warnings.
        """
        return self._shown("summary")

    def figure(self) -> Figure:
        """Return the whole picture of the result; nothing is shown or saved.

        Returns
        -------
        matplotlib.figure.Figure
            The picture.
        """
        return self._shown("figure")

    def page(self) -> Page:
        """Return the result as a page of HTML sections; `report.page.write_page` writes it."""
        return _doors().page(self)

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            raise self._missing(name)

    def _missing(self, name: str, hint: str = "") -> AttributeError:
        """Return the error for an attribute that there is not: it names the result's own method in place of pandas'."""
        hint = f"use .{_INSTEAD[name]}" if name in _INSTEAD else hint
        text = f"'{type(self).__name__}' has no attribute '{name}'{hint and '; '}{hint}"
        return AttributeError(text, name=name, obj=self)

    def __repr__(self) -> str:
        """Return headline and main values in at most ten lines."""
        return _doors().brief(self)

    def _repr_html_(self) -> str:
        """Return the same as a table with a small picture, for a notebook."""
        return _doors().html(self)

    def _shown(self, how: str, *more: Any) -> Any:
        with whole():
            presenter = import_module(f"{__package__}.report.{self.presenter}")
        return getattr(presenter, how)(self, *more)


def _doors() -> ModuleType:
    with whole():
        return import_module(f"{__package__}.report.doors")
