"""Checkpoints of strip water, compared.

results.py   one training: its errors in open and closed loop
table.py     rows over seeds, and what was not learned, in Markdown
"""
