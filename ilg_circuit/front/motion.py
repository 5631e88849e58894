"""Oscillators of neurons, and the soft arm that they move."""

from __future__ import annotations

from typing import Any

from ..arms.run import ArmResult
from ..arms.run import arm as move
from ..oscillators.run import RhythmRun
from ..oscillators.run import cpg as run
from .given import Given, Strip
from .given import load as strip_of


def cpg(duration: Given, **options: Any) -> RhythmRun:
    """Return the outputs over time of a central pattern generator, and its rhythm: period, amplitude, phases.

    Parameters
    ----------
    duration
        How long: a number [s] or a text such as "10 s".
    options
        ``engine`` ("ode" or "ngspice"), ``samples``, ``step``, ``start``, ``progress``; the network: ``topology``,
        ``size``, ``inhibition``, ``tonic``, ``adaptation``, ``rise_time``, ``adaptation_time``, ``weights`` of
        `oscillators.network.wired`.

    Raises
    ------
    InputError
        A value is out of range.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> ilg.cpg("10 s").rhythm.oscillates
    True
    """
    return run(duration, **options)


def arm(duration: Given, strip: Strip = "paper", **options: Any) -> ArmResult:
    """Return the motion of a soft arm that a rhythm drives through the circuits of its strips.

    Parameters
    ----------
    duration
        How long: a number [s] or a text such as "3 s".
    strip
        What the arm is cut from: an object, the path of a TOML file or a preset's name.
    options
        ``segments``, ``formulation``, ``coupling``, ``activation``, ``rhythm``, ``voltage``, ``reach`` and others of
        `arms.run.arm`.

    Raises
    ------
    InputError
        A value is out of range, or arguments contradict one another.
    SolveError
        The motion cannot be computed.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> moved = ilg.arm("20 ms", segments=5, activation="sine")
    >>> moved.motion.tip.shape
    (601, 2)
    """
    return move(duration, actuator=strip_of(strip), **options)
