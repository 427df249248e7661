"""The benchmark: simulated worlds unlike the paper's, and what re-identifiers make of them."""
