"""The study of the decisions: which verdicts change when a number or a rule does."""
