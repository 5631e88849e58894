"""From an ionic-liquid-gel strip's geometry and measurements to a solved, checked circuit."""

__version__ = "0.2.0"
