"""The paper's two tasks."""
