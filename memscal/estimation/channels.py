r"""Which voltage of a scan is fitted: the normal channel's, or a tangential one's.

A tangential channel measures one component of the shear at the base, a radial vector field,

.. math::

    U_{xz}(x, y) = A_{xz}\,(G_{xz} \otimes \tau)(R)\,\cos\theta + \text{baseline},

where :math:`R, \theta` lead from the sensor to the indenter and :math:`\tau` is the radial
traction of the base on the film, positive outward.  By both of its turns of sign (the film pulls
the base the other way, and the sensor lies on the other side of the indenter than the indenter of
the sensor) this is the traction of the film *on the sensor* along the scan's own axis.  Under a
film that is squeezed outward :math:`\tau` is negative: with A above zero the voltage falls where
the indenter stands at larger x than the sensor.
"""

from __future__ import annotations

import numpy as np

from memscal.errors import InputError
from memscal.model.scan import Scan
from memscal.model.validation import FloatArray

__all__ = ["CHANNELS", "TANGENTIAL", "channel_axis", "channel_order", "channel_signal"]

#: Channels that measure the shear along x and along y.
TANGENTIAL = ("xz", "yz")
#: All, the normal one first.
CHANNELS = ("zz", *TANGENTIAL)


def channel_order(channel: str) -> int:
    """Order of a channel's Hankel transforms: zero of a scalar, one of a vector's component.

    Raises
    ------
    InputError
        If there is no such channel.

    Examples
    --------
    >>> channel_order("zz"), channel_order("xz")
    (0, 1)
    """
    if channel not in CHANNELS:
        raise InputError(
            f"There is no channel {channel!r}.", cure=f"The channels are {', '.join(CHANNELS)}."
        )
    return int(channel in TANGENTIAL)


def channel_axis(channel: str) -> int:
    """Axis of the component that a tangential channel measures: 0 for x, 1 for y."""
    return int(channel == "yz")


def channel_signal(scan: Scan, channel: str) -> tuple[FloatArray, FloatArray | None]:
    """Return a channel's voltages and their stated standard uncertainty, in V.

    Raises
    ------
    InputError
        If the scan does not hold the channel, or cannot calibrate it: a raster, or a line across
        the component that the channel measures.
    """
    if channel_order(channel) == 0:
        if scan.sensor.channel in TANGENTIAL:
            raise InputError(
                f"The scan was recorded by channel {scan.sensor.channel}, but channel zz is to be "
                "calibrated.",
                why="A shear is not fitted by a normal stress.",
                cure=f"Store the voltage as u_{scan.sensor.channel} beside u_zz, and calibrate "
                f"channel {scan.sensor.channel}; or correct /entry/instrument/stress_sensor.",
            )
        return scan.u_zz, scan.u_zz_errors
    name, along = f"u_{channel}", channel[0]
    if name not in scan.channels:
        known = ", ".join(["u_zz", *scan.channels])
        raise InputError(
            f"The scan holds no {name}, only {known}.",
            why=f"Channel {channel} is calibrated with its own voltage.",
            cure=f"Import it (memscal import --{name.replace('_', '-')} COLUMN), or calibrate "
            "channel zz.",
        )
    if scan.planar:
        raise InputError(
            f"Channel {channel} cannot be calibrated with a raster.",
            why="A raster is used as a field, and the shear's has a line of zeros through it.",
            cure=f"Calibrate with lines along {along} through the sensor; cut one from the raster.",
        )
    if scan.direction != along:
        raise InputError(
            f"The scan runs along {scan.direction}, and channel {channel} measures the shear "
            f"along {along}.",
            why="On a line through the sensor the shear across the line is zero.",
            cure=f"Calibrate with a scan along {along}, or channel {scan.direction}z.",
        )
    u = scan.channels[name]
    if np.isinf(u).any():
        raise InputError(f"{name} holds an infinite voltage.", cure="Mark missing points with NaN.")
    return u, scan.channels.get(f"{name}_errors")
