"""The motion within a step, at uniform times: for paths, pictures, and what a prototype's foot has to hold."""

from __future__ import annotations

import numpy as np

from lean_yaw_env.kernel.compilation import entry_point, inlined
from lean_yaw_env.kernel.elementary import sine_cosine
from lean_yaw_env.kernel.flight import shift_end_of, stance_step
from lean_yaw_env.kernel.stance import (
    accelerations,
    floor_force,
    kinetic_energy,
    mass_matrix,
    mass_offset,
    middle_of_masses,
    middle_position,
)
from lean_yaw_env.kernel.step import stance_of

# Short enough for the eighth-order step's error to be at round-off everywhere on the way.
_LONGEST = 0.05

COLUMNS = (
    "time", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate", "mass_offset",
    "centre_x", "centre_y", "centre_z", "normal_force", "friction_demand", "yaw_torque", "mechanical_energy",
)  # fmt: skip
"""What a row holds; the centre of mass is in the stance frame (ahead, up, right), the energy is kinetic plus potential in it."""


@inlined
def _yaw_torque(c, t, x, b, w, v, dw, dv, ahead, aside):
    """Torque of the floor on the foot about the normal through the contact: the masses' changing moment of momentum."""
    sin_a, cos_a = sine_cosine(x + c.tilt)
    sin_b, cos_b = sine_cosine(b)
    _, q, dq = middle_of_masses(c, sin_b, cos_b, mass_offset(c, t)[0])
    px, _, pz = middle_position(c, x, sin_a, cos_a, q, dq)
    px = px + c.radius * x  # from where the foot touches now
    # the axle's direction and its acceleration
    a1 = cos_b * dv - sin_b * (w * w + v * v)
    aa = -sin_b * dw - 2.0 * cos_b * w * v
    az = -sin_b * dv - cos_b * v * v
    ax = cos_a * a1 + sin_a * aa
    return pz * ahead - px * aside + c.axle_inertia * (cos_b * ax - sin_b * cos_a * az)


@entry_point()
def trace(body, command, heading, pitch, ankle, pitch_rate, ankle_rate, side, duration, rows):
    """Fill ``rows`` (n, 13), n >= 2, with the stance motion at n uniform times from 0 to ``duration``; see ``COLUMNS``."""
    c = stance_of(body, command, heading, side)
    end = shift_end_of(c)
    n = rows.shape[0]
    t, x, b, w, v = 0.0, pitch, -ankle, pitch_rate, -ankle_rate
    for i in range(n):
        target = duration * i / (n - 1)
        while t < target - 1e-13:
            until = min(target, end) if t < end - 1e-13 else target
            h = (until - t) / np.ceil((until - t) / _LONGEST)
            dw, dv = accelerations(c, t, x, b, w, v)
            x, b, w, v, _, _, _, _ = stance_step(c, t, x, b, w, v, dw, dv, h)
            t = t + h
        dw, dv, ahead, normal, aside = floor_force(c, t, x, b, w, v)
        sin_a, cos_a = sine_cosine(x + c.tilt)
        sin_b, cos_b = sine_cosine(b)
        offset, offset_rate, _ = mass_offset(c, t)
        z, q, dq = middle_of_masses(c, sin_b, cos_b, offset)
        u, _, m11, m12, m22 = mass_matrix(c, sin_a, cos_a, sin_b, z, q, dq)
        px, py, pz = middle_position(c, x, sin_a, cos_a, q, dq)
        along = sin_b * (-u * w + dq * v) - cos_b * q * v
        energy = kinetic_energy(m11, m12, m22, w, v) + offset_rate * (along + 0.5 * offset_rate)
        friction = np.sqrt(ahead * ahead + aside * aside) / normal
        torque = _yaw_torque(c, t, x, b, w, v, dw, dv, ahead, aside)
        energy = energy - c.gravity_x * px - c.gravity_y * py - c.gravity_z * pz
        row = (t, x, -b, w, -v, offset, px, py, pz, normal, friction, torque, energy)
        for k, value in enumerate(row):
            rows[i, k] = value
