"""Reference pages from the program's own lists.

lists.py       `hydro gap effects --json` and `hydro attributes --json`
effects.py     docs/reference-effects.md
attributes.py  docs/reference-attributes.md
markdown.py    tables
"""
