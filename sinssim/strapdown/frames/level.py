"""Navigation in the local-level, north-pointing frame, interval by interval, of the fourth order.

The compensated increments are accurate to the sixth order in the interval (see `coning_sculling`). Gravity, Coriolis
acceleration and velocity are integrated by Simpson's rule, with values at mid-interval from cubic Hermite interpolation
between the ends. The rotation of the frame is the integral of its rate. The frame's own coning, u₀ × u₁/12 from its
turns u at the rates of both ends, is left out: for an aircraft at 4 g it is 5e-15 rad/s at 100 Hz and 5e-11 rad/s at
1 Hz.

Position (8.2):        φ̇ = v_N/(R₁+h),  λ̇ = v_E/((R₂+h) cos φ),  ḣ = −v_D
Velocity:              v̇ = C_nb f + g − (2ω_ie + ω_en) × v
Frame rate:            ω_in = ω_ie + ω_en,  ω_ie = (ω cos φ, 0, −ω sin φ),
                       ω_en = (v_E/(R₂+h), −v_N/(R₁+h), −v_E tan φ/(R₂+h))

The engine is a template over the attitude algorithm: `start_k`, `dcm_k`, `step_k` and `quaternion_k`, imported here
from the quaternion, and `fill_turns` are bound to each algorithm's own by `sinssim.jit.bind`. The increments may begin
before the first navigated interval, whose number is `first`, and continue beyond the last, because the fit uses
neighbours.
"""

from __future__ import annotations

from math import cos, degrees, pi, sin
from typing import Any, NamedTuple

import numpy as np

from sinssim.data import Array
from sinssim.earth.kernels import EarthParameters, gravity_ned_k, radii_k
from sinssim.errors import RunError
from sinssim.formatting import listed
from sinssim.frames import frames_that
from sinssim.jit import inline, strict_inline
from sinssim.rotation.kernels import cross_k, less_cross_k, product_k
from sinssim.strapdown.assemble import engines
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.frames.kernels import continued_k, resolved_k
from sinssim.strapdown.frames.problem import Problem, ran_away
from sinssim.strapdown.frames.radii import FORMS
from sinssim.strapdown.frames.vertical import BARO_LOOP, FREE, HELD, error_after_k, loop_gains_k, vertical_step_k
from sinssim.strapdown.increments.block_turns import BLOCK, empty_turns_k, turn_in_block_k
from sinssim.strapdown.increments.block_turns import fill_fitted_turns as fill_turns
from sinssim.strapdown.increments.interval import BodyTurn, FrameTurn
from sinssim.strapdown.polar import POLAR_LIMIT

EXACT_EVERY = 128
"""Steps between new sines and cosines of the latitude."""


@strict_inline
def curvatures_k(p: EarthParameters, simplified: bool, s: float, h: float) -> tuple[float, float, float]:
    """1/(R₁+h), 1/(R₂+h) and R₂."""
    r1, r2 = radii_k(p, s)
    if simplified:  # (8.16)
        x = h / p.a
        return (1.0 + p.e2 * (1.0 - 1.5 * s * s) - x) / p.a, (1.0 - 0.5 * p.e2 * s * s - x) / p.a, r2
    inverse = 1.0 / ((r1 + h) * (r2 + h))
    return (r2 + h) * inverse, (r1 + h) * inverse, r2


@inline
def _rates_k(
    turn: float, s: float, c: float, secant: float, k1: float, k2: float, vn: float, ve: float
) -> tuple[float, float, float, float, float, float]:
    """Rates at a point of the interval, times the interval.

    turn, k1 and k2 are the Earth's rotation and the curvatures times the interval; s, c and secant are those of the
    latitude. Returned are the changes of latitude and longitude, the frame's rotation ω_in north and down (east it is
    the change of latitude reversed), and 2ω_ie + ω_en north and down.
    """
    dlat, along = product_k(vn, k1), product_k(ve, k2)
    dlon = product_k(along, secant)
    return (
        dlat, dlon, along + turn * c, product_k(-s, turn + dlon), along + 2.0 * turn * c, -s * (2.0 * turn + dlon)
    )  # fmt: skip


@inline
def moved_k(s: float, c: float, change: float) -> tuple[float, float]:
    """Sine and cosine of an angle after a small change, from those before it (to the fourth order)."""
    y = change * change
    sine, versine = change * (1.0 - y / 6.0), y * (0.5 - y / 24.0)
    return s - s * versine + c * sine, c - c * versine - s * sine


class LevelState(NamedTuple):
    """Velocity and position of one run at an edge, with the values that follow from them.

    v: velocity north, east, down, m/s.
    h, north, east: height, m; displacement from the start in latitude and longitude, rad.
    s, c, i: sine, cosine and secant of the latitude.
    k1, k2: curvatures 1/(R₁+h) and 1/(R₂+h), 1/m.
    g: gravity north and down, m/s².
    a: change of velocity over the last interval at the rate of its end, m/s.
    loop_sum, loop_error: integral and held error of the baro loop.
    """

    vn: float
    ve: float
    vd: float
    h: float
    north: float
    east: float
    s: float
    c: float
    i: float
    k1: float
    k2: float
    gn: float
    gd: float
    an: float
    ae: float
    ad: float
    loop_sum: float
    loop_error: float


@inline
def start_level_k(
    p: EarthParameters, gravity: int, simplified: bool,
    lat: float, h: float, vn: float, ve: float, vd: float, loop_error: float,
) -> LevelState:  # fmt: skip
    """State at the start."""
    s, c = sin(lat), cos(lat)
    k1, k2, r2 = curvatures_k(p, simplified, s, h)
    gn, gd = gravity_ned_k(p, gravity, s, c, r2, h)
    return LevelState(vn, ve, vd, h, 0.0, 0.0, s, c, 1.0 / c, k1, k2, gn, gd, 0.0, 0.0, 0.0, 0.0, loop_error)


# Long: the step of one interval, whose quantities depend on each other.
@inline
def step_level_k(
    p: EarthParameters, gravity: int, simplified: bool, vertical: int, gains: tuple[float, float, float],
    dt: float, lat0: float, lon0: float, reference: float, climb: float, b: BodyTurn, attitude: Any, x: LevelState,
) -> tuple[LevelState, Any]:  # fmt: skip
    """State and attitude one interval later: the step of one run, for every kernel that navigates in this frame.

    lat0 and lon0 are the coordinates of the start, and reference and climb those of the vertical channel at the
    interval's end.
    """
    vn, ve, vd, h, s, c, i0, k1, k2, gn, gd = x.vn, x.ve, x.vd, x.h, x.s, x.c, x.i, x.k1, x.k2, x.gn, x.gd
    # the Earth's rotation, curvatures and gravity times the interval
    turn, r1, r2 = product_k(dt, p.omega), product_k(dt, k1), product_k(dt, k2)
    tn, td = product_k(dt, gn), product_k(dt, gd)

    # --- Earth at the interval's end, at an extrapolated position: this long chain of divisions and roots is then
    # independent of the body's and runs in parallel. The final position corrects it to first order.
    dlat_taken = product_k(r1, vn + 0.5 * x.an)
    h_taken = h - dt * (vd + 0.5 * x.ad)
    s1, c1 = moved_k(s, c, dlat_taken)
    k1_1, k2_1, radius = curvatures_k(p, simplified, s1, h_taken)
    gn1, gd1 = gravity_ned_k(p, gravity, s1, c1, radius, h_taken)
    i1 = 1.0 / c1
    # how fast the secant grows with latitude, and curvatures and gravity down decrease with height
    i_rate, k1_rate, k2_rate, g_rate = s1 * i1 * i1, k1_1 * k1_1, k2_1 * k2_1, 2.0 * gd1 * k2_1
    r1_1, r2_1 = product_k(dt, k1_1), product_k(dt, k2_1)

    # --- into the navigation axes of the start
    c_nb = dcm_k(attitude)
    dn, de, dd = resolved_k(c_nb, b.dv_x, b.dv_y, b.dv_z)
    sn, se, sd = resolved_k(c_nb, b.fs_x, b.fs_y, b.fs_z)
    en, ee, ed = resolved_k(c_nb, b.fe_x, b.fe_y, b.fe_z)
    # what the frame's rotation turns: the increment less ∫∫a/dt
    mn, me, md = product_k(0.5, dn), product_k(0.5, de), product_k(0.5, dd)
    mn, me, md = mn + (en - sn) / 12.0, me + (ee - se) / 12.0, md + (ed - sd) / 12.0
    on, oe, od = vn + dn, ve + de, vd + dd

    # --- start of the interval: frame's rotation, Coriolis and acceleration, times dt
    dlat0, dlon0, un0, ud0, wn, wd = _rates_k(turn, s, c, i0, r1, r2, vn, ve)
    ue0 = -dlat0
    cn0, ce0, cd0 = cross_k(wn, ue0, wd, -vn, -ve, -vd)
    an0, ae0, ad0 = sn + tn + cn0, se + ce0, sd + td + cd0

    # --- velocity at the end, predicted: the frame's rotation during the interval turns the increment by −∫ζ × a,
    # and Coriolis acts as at mid-interval
    vnm, vem, vdm = vn + 0.5 * an0, ve + 0.5 * ae0, vd + 0.5 * ad0
    dlatm, _, _, _, wn, wd = _rates_k(turn, s, c, i0, r1, r2, vnm, vem)
    vn1, ve1, vd1 = less_cross_k(on + tn, oe, od + td, un0, ue0, ud0, mn, me, md)
    vn1, ve1, vd1 = less_cross_k(vn1, ve1, vd1, wn, -dlatm, wd, vnm, vem, vdm)
    # the end's specific force in the navigation axes of the end
    en, ee, ed = less_cross_k(en + dt * gn1, ee, ed + dt * gd1, un0, ue0, ud0, en, ee, ed)
    dlat1, _, un1, ud1, wn, wd = _rates_k(turn, s1, c1, i1, r1_1, r2_1, vn1, ve1)
    ue1 = -dlat1
    cn1, ce1, cd1 = cross_k(wn, ue1, wd, -vn1, -ve1, -vd1)
    an, ae, ad = en + cn1, ee + ce1, ed + cd1

    # --- middle of the interval: cubic Hermite interpolation for velocity and the values that depend on position.
    # Velocity, curvatures and cosine are doubled, so that the rates are fourfold, as Simpson's rule takes them.
    vnm, vem, vdm = vn + vn1 + 0.25 * (an0 - an), ve + ve1 + 0.25 * (ae0 - ae), vd + vd1 + 0.25 * (ad0 - ad)
    bend, bend_h = 0.125 * (dlat0 - dlat1), 0.25 * dt * (vd - vd1)  # ⅛ (φ̇₀ − φ̇₁) dt, ¼ (ḣ₁ − ḣ₀) dt
    sm, im = product_k(0.5, s + s1) + c1 * bend, product_k(0.5, i0 + i1) + i_rate * bend
    cm = c + c1 - 2.0 * s1 * bend
    bend_r = dt * bend_h
    dlatm, along = product_k(vnm, r1 + r1_1 + k1_rate * bend_r), product_k(vem, r2 + r2_1 + k2_rate * bend_r)
    dlonm = product_k(along, im)
    unm, udm = along + 2.0 * turn * cm, product_k(-sm, 4.0 * turn + dlonm)
    wn, wd = along + 4.0 * turn * cm, -sm * (8.0 * turn + dlonm)
    cnm, cem, cdm = cross_k(wn, -dlatm, wd, -vnm, -vem, -vdm)  # eightfold

    # --- velocity and position at the end
    # −∫ζ × a with ζ = u₀ τ + (u₁ − u₀) τ²/2, and +½∫ζ × (ζ × a)
    wn, we, wd = un0 + (un1 - un0) / 3.0, ue0 + (ue1 - ue0) / 3.0, ud0 + (ud1 - ud0) / 3.0
    qn, qe, qd = cross_k(wn, we, wd, dn, de, dd)
    on, oe, od = less_cross_k(on, oe, od, wn, we, wd, mn - qn / 6.0, me - qe / 6.0, md - qd / 6.0)
    half = 0.5 * dt
    vn1 = on + half * (gn + gn1) + (cn0 + cn1) / 6.0 + cnm / 12.0
    ve1 = oe + (ce0 + ce1) / 6.0 + cem / 12.0
    vd1 = od + half * (gd + gd1 + 2.0 / 3.0 * g_rate * bend_h) + (cd0 + cd1) / 6.0 + cdm / 12.0
    dlat = product_k(1.0 / 6.0, dlat0 + dlatm + vn1 * r1_1)
    along = product_k(ve1, r2_1)
    east = x.east + (dlon0 + dlonm + along * i1) / 6.0
    h1 = h - dt / 6.0 * (vd + 2.0 * vdm + vd1)

    # --- vertical channel
    h1, vd1, loop_sum, loop_error = vertical_step_k(
        vertical, dt, gains[0], gains[1], gains[2], x.loop_sum, x.loop_error, h1, vd1, reference, climb
    )

    # --- attitude, with the frame's rotation ζ = ∫ω_in by Simpson's rule
    frame = FrameTurn(
        (un0 + unm + un1) / 6.0, (ue0 - dlatm + ue1) / 6.0, (ud0 + udm + ud1) / 6.0,
        un0, ue0, ud0, 0.25 * unm, -0.25 * dlatm, 0.25 * udm, un1, ue1, ud1,
    )  # fmt: skip
    attitude = step_k(attitude, b, frame)

    # summed from the start: in a sum with the latitude, a slow vehicle's steps would be lost by rounding
    north = x.north + dlat
    if lon0 + east > pi:
        east -= 2.0 * pi
    elif lon0 + east <= -pi:
        east += 2.0 * pi

    # --- the Earth's values, corrected from the extrapolated to the final position
    moved, moved_h = dlat - dlat_taken, h1 - h_taken
    after = LevelState(
        vn1, ve1, vd1, h1, north, east, s1 + c1 * moved, c1 - s1 * moved, i1 + i_rate * moved,
        k1_1 - k1_rate * moved_h, k2_1 - k2_rate * moved_h, gn1, gd1 - g_rate * moved_h,
        an, ae, ad, loop_sum, loop_error,
    )  # fmt: skip
    return after, attitude


@inline
def refreshed_k(lat0: float, x: LevelState) -> LevelState:
    """The same state with new sine and cosine of the latitude, which accumulate rounding errors."""
    s, c = sin(lat0 + x.north), cos(lat0 + x.north)
    return LevelState(
        x.vn, x.ve, x.vd, x.h, x.north, x.east, s, c, 1.0 / c,
        x.k1, x.k2, x.gn, x.gd, x.an, x.ae, x.ad, x.loop_sum, x.loop_error,
    )  # fmt: skip


# A compiled engine: one loop with its state in scalars.
def _navigate(
    time: Array,
    dtheta: Array,
    dvel: Array,
    weights: Array,
    uniform: bool,
    first: int,
    p: EarthParameters,
    gravity: int,
    simplified: bool,
    vertical: int,
    height_reference: Array,
    climb_reference: Array,
    time_constant: float,
    latitude: Array,
    longitude: Array,
    height: Array,
    velocity: Array,
    q_nb: Array,
    defect: Array,
) -> None:
    count = time.shape[0] - 1
    lat0, lon0, h0 = latitude[0], longitude[0], height[0]
    attitude = start_k(q_nb[0, 0], q_nb[0, 1], q_nb[0, 2], q_nb[0, 3])
    q0, q1, q2, q3, defect[0] = quaternion_k(attitude)
    error = 0.0
    if vertical == BARO_LOOP:
        error = error_after_k(height_reference[0], h0, 0.0)
    x = start_level_k(p, gravity, simplified, lat0, h0, velocity[0, 0], velocity[0, 1], velocity[0, 2], error)
    gains = loop_gains_k(time_constant, x.gd, x.k2)
    turns = empty_turns_k()
    reference, climb = 0.0, 0.0

    for k in range(count):
        if k % BLOCK == 0:
            fill_turns(dtheta, dvel, weights, uniform, first + k, first + min(k + BLOCK, count), turns)
        if k % EXACT_EVERY == 0:
            x = refreshed_k(lat0, x)
        if vertical != FREE:
            reference = height_reference[k + 1]
        if vertical == HELD:
            climb = climb_reference[k + 1]
        x, attitude = step_level_k(
            p, gravity, simplified, vertical, gains, time[k + 1] - time[k], lat0, lon0, reference, climb,
            turn_in_block_k(turns, k % BLOCK), attitude, x,
        )  # fmt: skip
        latitude[k + 1], longitude[k + 1], height[k + 1] = lat0 + x.north, lon0 + x.east, x.h
        velocity[k + 1, 0], velocity[k + 1, 1], velocity[k + 1, 2] = x.vn, x.ve, x.vd
        r0, r1, r2, r3, defect[k + 1] = quaternion_k(attitude)
        q0, q1, q2, q3 = continued_k(q0, q1, q2, q3, r0, r1, r2, r3)
        q_nb[k + 1, 0], q_nb[k + 1, 1], q_nb[k + 1, 2], q_nb[k + 1, 3] = q0, q1, q2, q3


engine = engines(_navigate, "level", FORMS)


def solve(problem: Problem, frame: str) -> None:
    """Navigate in the level frame; see `sinssim.strapdown.files.FrameFile`."""
    p = problem
    engine(p.algorithm, p.form)(
        p.time, p.dtheta, p.dvel, p.weights, p.uniform, p.first, p.earth, p.gravity, p.simplified, *p.channel,
        *p.solution,
    )  # fmt: skip


def check(problem: Problem, frame: str) -> None:
    """Raise if the solution comes too near to a pole.

    Args:
        problem: solved.
        frame: "level".

    Raises:
        RunError: it does.
    """
    latitude = problem.latitude
    if max(float(np.max(latitude)), -float(np.min(latitude))) <= POLAR_LIMIT:
        return
    row = int(np.argmax(~(np.abs(latitude) <= POLAR_LIMIT)))
    if not abs(latitude[row]) <= 0.5 * pi:  # no step of a vehicle crosses the pole from 89.9°
        raise ran_away(problem, "latitude", row)
    able = listed(frames_that(lambda entry: entry.passes_poles))
    time = float(problem.time[row])
    raise RunError(
        f"the north-pointing level frame cannot be used within {90.0 - degrees(POLAR_LIMIT):.1f}° of a pole, where "
        f"the direction of north changes too fast: latitude {degrees(latitude[row]):.4f}° at t = {time:.2f} s. "
        f"The frames {able} pass the poles.",
        time=time,
    )
