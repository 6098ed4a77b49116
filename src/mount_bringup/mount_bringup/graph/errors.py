"""Why a graph ended early; apart, for who only has to tell of it need not load the graph."""


class GraphError(RuntimeError):
    """The graph could not be started or broke down; the text names the node and its reason."""


class Interrupted(Exception):  # noqa: N818 - no error: the user ends it
    """The user asked to end."""
