"""Circles in a directed graph: Tarjan's strongly connected components (SIAM J. Computing 1, 1972)."""

from collections.abc import Hashable, Iterable, Mapping


def circles(arrows: Mapping[Hashable, Iterable[Hashable]]) -> list[list[Hashable]]:
    """Groups of two or more nodes that reach each other."""
    index: dict = {}
    low: dict = {}
    stack: list = []
    found: list[list] = []

    def visit(node: Hashable) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for target in arrows.get(node, ()):
            if target not in index:
                visit(target)
                low[node] = min(low[node], low[target])
            elif target in stack:
                low[node] = min(low[node], index[target])
        if low[node] == index[node]:
            group = []
            while True:
                group.append(stack.pop())
                if group[-1] == node:
                    break
            if len(group) > 1:
                found.append(sorted(group))

    for node in arrows:
        if node not in index:
            visit(node)
    return found
