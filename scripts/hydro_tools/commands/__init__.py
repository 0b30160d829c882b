"""Command lines: a module for each script in scripts/, under the script's name; `main` returns the exit status."""
