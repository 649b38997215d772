"""Each subject of the report: one function from a result to its panel."""
