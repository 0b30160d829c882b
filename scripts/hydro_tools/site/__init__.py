"""The documentation site: README.md and docs/ as they are, by MkDocs.

pages.py      the files that the pages link, with the folders that they stand in
notebooks.py  scripts of jupytext to pages with their outputs
mkdocs.yml    navigation, theme, plugins, what is checked
site.css      what differs from the theme
"""
