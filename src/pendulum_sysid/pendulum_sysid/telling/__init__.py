"""Tell people and programs what a diagnosis found: outcome, sentences, report, pictures, tables."""
