"""A scene: mesh, supports, planes of symmetry, loads and tools, and the checks of them."""
