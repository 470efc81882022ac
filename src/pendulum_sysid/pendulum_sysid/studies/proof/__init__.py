"""The proof: concealed rigs are recorded, diagnosed without a look at the seal, and judged once the seal is open."""
