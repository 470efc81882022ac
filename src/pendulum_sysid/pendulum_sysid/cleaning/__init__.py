"""Clean recordings: a detector a file, one sequence."""
