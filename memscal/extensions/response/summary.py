"""The response of a sensor as tables and mapping, as ``memscal response`` prints it."""

import math

import numpy as np

from memscal.extensions.response.response import Response
from memscal.model.arrays import Values
from memscal.model.quantities import MM, Quantity, measured
from memscal.summaries.declared import cell, members
from memscal.summaries.table import Table


def _quantities(seen: Response) -> tuple[Quantity, ...]:
    gain = Quantity("gain", "voltage per stress", "gain").read_in(seen.apparatus.reading)
    return (
        Quantity("wavelength", "length", "wavelength"),
        *measured(gain),
        Quantity("phase", "angle", "phase"),
        Quantity("frequency", "frequency", "frequency"),
        Quantity("smallest_stress", "stress", "smallest stress", shown="Pa"),
    )


def mapping(seen: Response) -> Values:
    """Return the object of ``response --json``."""
    declared = _quantities(seen)
    waves = []
    for wave in seen.waves:
        values = members(declared, wave) | {"resolved": wave.resolved}
        if not wave.resolved:
            values["gain"] = None
        waves.append(values)
    return {"schema_version": "1", "waves": waves}


def answer(seen: Response) -> str:
    """Return which waves are resolved, and from which speed on drift does not rule."""
    shortest = 2 * math.pi / seen.apparatus.resolved_wavenumber
    resolved = (
        f"Under a film of {seen.film.thickness / MM:.4g} mm the calibration resolves waves of "
        f"{shortest / MM:.3g} mm or longer."
    )
    lines = [resolved]
    noise = seen.noise_record
    if noise is not None and np.any(seen.frequency < noise.corner):
        lines.append(f"Below {noise.corner:.3g} Hz drift rules the noise: move faster.")
    low, high = seen.noise_band
    if np.any((seen.frequency < low) | (seen.frequency > high)):
        lines.append(
            f"The noise is known from {low:.3g} to {high:.3g} Hz: outside, no stress is given."
        )
    return "\n".join(lines)


def tables(seen: Response) -> list[Table]:
    """Return one row for each wave, with what is known of it."""
    timed = seen.speed is not None
    heard = seen.noise_record is not None
    head = ["wavelength (mm)"] + ["speed (mm/s)"] * timed + ["gain", "phase (rad)"]
    head += ["frequency (Hz)"] * timed + ["smallest stress (Pa)"] * heard
    gain = _quantities(seen)[1]
    rows = []
    for wave in seen.waves:
        row = [f"{wave.wavelength / MM:.4g}"]
        row += [f"{wave.frequency * wave.wavelength / MM:.4g}"] * timed
        phase = f"{wave.phase:.3f}"
        row += [cell(gain, wave), phase] if wave.resolved else ["not resolved", "-"]
        row += [f"{wave.frequency:.4g}"] * timed
        row += ["-" if math.isnan(wave.smallest_stress) else f"{wave.smallest_stress:.3g}"] * heard
        rows.append(row)
    title = "Reading per pressure of a wave (± standard uncertainty, k = 1)"
    if seen.friction:
        title += f", with a shear of {seen.friction:.4g} times the pressure"
    return [Table(title, head, rows)]
