"""Figure of a dwell record with the creep that was found in it."""

from matplotlib.figure import Figure

from memscal.extensions.motion.creep import Creep, dwell_readings
from memscal.figures.style import GAUSSIAN, MEASURED, draw_residual_band, legend_above, panels_of


def creep_figure(creep: Creep) -> Figure:
    """Draw readings and creep by time, and the residuals over their scatter."""
    record = creep.record
    time = record.time
    assert time is not None  # of a dwell record
    found = dwell_readings(time, *creep.parameters.values[:3])
    left = record.u_zz - found
    scale = record.reading.scale
    with panels_of(4.0, 2, sharex=True) as (figure, [above, below]):
        above.plot(time, record.u_zz / scale, ".", color=MEASURED, ms=2, label="record")
        above.plot(time, found / scale, color=GAUSSIAN, label="creep of one time")
        above.set(ylabel=f"reading ({record.reading.unit})")
        above.set_xscale("symlog", linthresh=time[time > 0][0])
        legend_above(above)
        draw_residual_band(below)
        below.plot(time, left / left.std(), ".", color=MEASURED, ms=2)
        below.set(xlabel="time from the contact (s)", ylabel="residual (u)")
    return figure
