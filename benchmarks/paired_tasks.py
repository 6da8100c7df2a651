"""The side of a pair that is measured, in a process of its own: ``python -P benchmarks/paired_tasks.py TASK SIZE``.

To every line on stdin it answers with processor seconds of a pass (of ``importing``: of the import, which can be asked
once; of a march: of all its passes), the passes they were taken from, and which ``bipot`` was measured. It runs on
other states of the library too, so it uses public names alone, and imports nothing early that ``bipot`` would import
itself. A history's first increment, which sets everything up, is not timed.
"""

from __future__ import annotations

import sys
import time

TYPE_CHECKING = False
if TYPE_CHECKING:
    from bipot import Scene, Schedule
    from bipot.forms import Form

SMALL = 0.001
"""First increments under friction, a fraction of the height."""


def importing(size: int) -> tuple[float, int]:
    """Seconds of ``import bipot``."""
    began = time.process_time()
    import bipot  # noqa: F401

    return time.process_time() - began, 1


def newton(size: int) -> tuple[float, int]:
    """The seed paper's cylinder, mu = 0.1, to 45 %."""
    from bipot import Newton, Schedule, upsetting

    schedule = Schedule(8, first=SMALL / 0.45, settling=1, growth=2.4)
    return _passes(upsetting(mu=0.1, reduction=0.45, elements=size), schedule, Newton())


def newton_march(size: int) -> tuple[float, int]:
    """The same march as a whole: passes of one state may be fewer and cost more than those of another."""
    seconds, count = newton(size)
    return seconds * count, count


def newton_wide(size: int) -> tuple[float, int]:
    """A plane block of 2 size + 1 contact nodes."""
    from bipot import Newton, Schedule

    return _passes(_wide(size), Schedule(4), Newton())


def tangent_wide(size: int) -> tuple[float, int]:
    """The same by the other form."""
    from bipot import Schedule, Tangent

    return _passes(_wide(size), Schedule(4), Tangent())


def delassus(size: int) -> tuple[float, int]:
    """The cylinder under a punch that meets its upper face alone, the edge smooth: 4 size rows."""
    from dataclasses import replace

    from bipot import Schedule, upsetting
    from bipot.forms import Delassus

    scene = upsetting(mu=0.3, reduction=0.1, elements=size)
    top = scene.mesh.boundary_nodes("top")
    edge = top[scene.mesh.nodes[top, 0].argmax()]
    punch = replace(scene.tools[0], candidates=("top",), mu_at={int(edge): 0.0})
    schedule = Schedule(6, first=SMALL / 0.1, settling=4, growth=2)
    return _passes(replace(scene, tools=(punch,)), schedule, Delassus())


def _wide(size: int) -> Scene:
    """A quarter of a flat block, pressed by half a per cent of its height."""
    from dataclasses import replace

    from bipot import Element, FlatTool, Geometry, Support, upsetting
    from bipot.meshes.sections import block

    return replace(
        upsetting(mu=0.1, elements=1),
        mesh=block(float(size), 2.0, size, 2).to(Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        supports=(Support("base", 1), Support("left", 0)),
        tools=(FlatTool((0.0, 2.0), (0.0, -1.0), (0.0, -0.01), ("top",), 0.1),),
    )


def _passes(scene: Scene, schedule: Schedule, form: Form) -> tuple[float, int]:
    """Processor seconds a pass, and passes, of all increments but the first."""
    from bipot import Control, march

    running = march(scene, schedule, Control(form, ()))
    next(running)
    began = time.process_time()
    passes = sum(accepted.passes for accepted in running)
    return (time.process_time() - began) / passes, passes


TASKS = {f.__name__: f for f in (importing, newton, newton_march, newton_wide, tangent_wide, delassus)}

if __name__ == "__main__":
    for _ in sys.stdin:
        _seconds, _count = TASKS[sys.argv[1]](int(sys.argv[2]))
        print(_seconds, _count, sys.modules["bipot"].__file__, flush=True)
