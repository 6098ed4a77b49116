"""Lifecycle nodes that fail closed: parameters, diagnostics, processes."""
