"""A window with sliders, served to this machine: a strip is fitted, moved, swept, designed and exported in it.

In: files and clicks, as texts with units. Out: pictures, tables and files of the front door's results, one session and
one solver process a window. May import: all rooms but `commands`.
"""
