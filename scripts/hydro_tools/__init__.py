"""Tools behind the commands in scripts/: data, scenes, baselines, benchmarks for `hydro`."""
