"""Reference pages from the program's own lists, and from docstrings.

lists.py         `hydro gap effects --json` and `hydro attributes --json`
effects.py       docs/reference-effects.md
attributes.py    docs/reference-attributes.md
environments.py  docs/reference-envs.md
markdown.py      tables
"""
