"""The paper's tables, figures and claims from the studies in a folder."""
