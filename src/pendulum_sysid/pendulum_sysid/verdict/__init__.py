"""The verdict: a typed record, its JSON form, and its views in a notebook."""
