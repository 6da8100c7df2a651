"""A scene: mesh, supports, planes of symmetry, loads and tools, and what is refused of them."""
