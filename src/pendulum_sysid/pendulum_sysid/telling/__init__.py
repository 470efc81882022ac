"""Tell people and programs the result: outcome, sentences, report, pictures, tables."""
