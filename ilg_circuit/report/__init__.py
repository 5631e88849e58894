"""How results look: text tables, pictures, HTML pages.

In: results, which hold data only. Out: text, figures and files. May import: every room that it shows.
"""
