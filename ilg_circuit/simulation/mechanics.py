"""Names how the shape of a strip is computed; on its own, since the command's help must not load numpy."""

#: Arcs of the free curvatures, a beam at rest under weight and load, a chain of arcs with inertia.
MECHANICS = ("free", "elastica", "arm")
