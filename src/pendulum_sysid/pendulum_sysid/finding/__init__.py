"""Find what a twin lacks: search, judge, localise, and read off what no fit can find."""
