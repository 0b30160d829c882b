"""Rules of the house that no compiler checks: import circles, file lengths, who may be unsafe and who may print."""
