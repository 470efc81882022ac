"""Physics that the catalogue does not hold: a diagnosis must not give it a catalogue name."""
