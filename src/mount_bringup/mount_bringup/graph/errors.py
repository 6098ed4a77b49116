"""Why a graph ended early; apart, for who only has to tell of it need not load the graph."""

INTERRUPTED = 130
"""The exit code of a command that the user has ended, as a shell reports SIGINT."""


class GraphError(RuntimeError):
    """The graph could not be started or broke down; the text names the node and its reason."""


class Interrupted(Exception):  # noqa: N818 - no error: the user ends it
    """The user asked to end; the text, if any, says what stands then."""
