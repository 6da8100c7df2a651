"""Material and contact laws as pure functions of arrays: no mesh, no scene."""
