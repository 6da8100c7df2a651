r"""Verification: every case is a scene with an answer that no finite element code found, on a series of meshes.

    python -m studies.verification [--only NAME ...] [--fast] [--resume | --overwrite] [--out DIR] [--page FILE]

Writes ``DIR/verification.csv``, a row for each number of each mesh, after every mesh, and with ``--page`` the page of
all cases from it (:mod:`studies.verification.page`). A case is judged on its finest mesh, and where it marches on what
other forms find on its coarsest (:mod:`studies.verification.forms`): exit code 1 where a number misses its tolerance
there. ``--fast`` runs the coarsest mesh of each case without other forms, and judges those that have one mesh alone.
Cases are the files of :mod:`studies.verification.cases`.
"""
