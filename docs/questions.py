"""Writes docs/questions.md, the fourteen control questions with computed numbers: `python docs/questions.py`."""

from __future__ import annotations

import math
import sys
import textwrap
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import question_numbers as numbers

FILE = Path(__file__).with_name("questions.md")

ROUNDING = 1e-6
"""Errors below this are rounding, which differs between machines: the page gives a bound for them."""


def digits(value: float) -> str:
    """Return a value with three significant digits, without an exponent."""
    places = max(0, 2 - math.floor(math.log10(abs(value)))) if value else 0
    return f"{value:.{places}f}" if abs(value) < 1000.0 else f"{float(f'{value:.3g}'):.0f}"


def small(value: float) -> str:
    """Return a value with two significant digits, or the next power of ten above it if it is rounding."""
    if value == 0.0:
        return "0"
    if value < ROUNDING:
        return f"below 1e{math.floor(math.log10(value)) + 1:d}"
    return digits(value) if value >= 0.1 else f"{value:.1e}"


def share(value: float) -> str:
    """Return a small part of a whole in words."""
    return small(value).replace("below", "less than")


def wrapped(text: str) -> str:
    """Return Markdown with its paragraphs and list items wrapped; headings, tables and pictures stay."""
    blocks = []
    for block in text.strip().split("\n\n"):
        if block.startswith("- "):
            items = [item.replace("\n", " ") for item in block.removeprefix("- ").split("\n- ")]
            filled = [textwrap.fill(" ".join(item.split()), 118).replace("\n", "\n  ") for item in items]
            blocks.append("\n".join(f"- {item}" for item in filled))
        else:
            blocks.append(block if block[0] in "#|!" else textwrap.fill(" ".join(block.split()), 120))
    return "\n\n".join(blocks) + "\n"


def _platform() -> str:
    roll = numbers.roll()
    return f"""\
## 1. What replaces the gyro-stabilised platform?

The computer does. The gyros give the rotation of the body, and the attitude algorithm integrates it to the direction
cosine matrix C_nb. This matrix is an analytic platform: it turns the readings of accelerometers that are fixed to the
body into the axes of navigation.

![A computed platform: sensors, compensation, attitude, velocity and position](images/strapdown_scheme.svg)

On a table that turns ten times about the forward axis at 300 °/s, with perfect sensors at 200 Hz, the computed platform
stays level: its error in {roll.seconds:.0f} s is {small(roll.perfect_arcsec)}″.
"""


def _advantages() -> str:
    loop = numbers.loop()
    return f"""\
## 2. What are the advantages of strapdown systems?

They have no gimbals, bearings, slip rings or torquers. They are therefore smaller, lighter, cheaper and more reliable,
and they are ready sooner. Spare sensors can be added on any axis. The same sensors give the angular rate and the
specific force of the body to the flight control.

No attitude is forbidden. In a full turn in pitch, which would lock a platform of three gimbals, the
attitude error of the quaternion algorithm at 100 Hz is
{small(loop.quaternion_arcsec)}″. Euler angles are the gimbals of the computer: in the same turn they are
off by {digits(loop.euler_arcsec)}″.
"""


def _difficulties() -> str:
    roll = numbers.roll()
    rows = "\n".join(f"| {rate:g} | {digits(numbers.coning(rate))} |" for rate in (10.0, 20.0, 50.0, 100.0, 200.0))
    return f"""\
## 3. What are the difficulties?

The sensors feel the full motion of the body. A gyro must measure 300 °/s and must not drift by more than 0.01 °/h, a
ratio of {300.0 * 3600.0 / 0.01 / 1e6:.0f} million. Its scale factor acts on every turn: an error of 10 ppm costs
{digits(roll.scaled_arcsec)}″ in ten turns, where 10⁻⁵ · 3600° is 129.6″. On a platform, which does not turn with the
body, this error hardly acts. Mounting angles and vibration act in the same way.

The attitude algorithm must follow fast motion. On a cone of 1° at 1 Hz the first-order quaternion step has this error
after a minute:

| rate, Hz | attitude error, ″ |
|---|---|
{rows}
"""


def _variants() -> str:
    times = (10.0, 60.0, 120.0)
    sets = numbers.variants(times)
    names = {
        "accelerometers": "six accelerometers of 1 µg (1σ), arms of 1 m",
        "gyros": "three accelerometers, three rate gyros of 0.01 °/h",
        "attitude": "three accelerometers, an attitude sensor that is off by 10″",
    }
    rows = "\n".join(f"| {names[name]} | " + " | ".join(digits(float(v)) for v in sets[name]) + " |" for name in names)
    return f"""\
## 4. Which variants of the scheme are there?

Three sets of sensors give the attitude in three ways: by two integrations of the angular acceleration of six
accelerometers, by one integration of the rate of gyros, or directly. Position error of a level block at rest, in m:

| sensors | 10 s | 1 min | 2 min |
|---|---|---|---|
{rows}

The error of the first set grows with the fourth power of time at first, that of the second with the third power, that
of the third with the square. `sinssim compare sensor_sets` flies all three.
"""


def _usual() -> str:
    expectation = numbers.airliner()
    first = next(c for c in expectation.contributions if "gyro bias" in c.term)
    return f"""\
## 5. Which scheme is usual on manned aircraft?

Three rate gyros and three accelerometers at one place, near the centre of mass, with navigation in the local level.
Laser gyros of 0.01 °/h and accelerometers of 50 µg (the grade `laser-standard`) give a position error of
{digits(expectation.total / 1852.0)} nmi (1σ) after an hour. The bias of one level gyro alone gives
{digits(first.position / 1852.0)} nmi. `sinssim sensors laser-standard` lists all contributions.
"""


def _one_component() -> str:
    by_accelerometer, by_gyro = numbers.pendulum(True), numbers.pendulum(False)
    return f"""\
## 6. What is the character of the coordinate error by an accelerometer?

It oscillates and stays bounded. The system with one component shows it: two accelerometers and a gyro in a vertical
plane.

![Axes of the system with one component](images/one_component_axes.svg)

![Its scheme](images/one_component_scheme.svg)

An error of the coordinate tilts the computed horizon, and the tilt projects gravity against the error. This loop is a
pendulum of the Schuler period, {digits(by_accelerometer.period_min)} min.

![The loop of the errors](images/schuler_loop.svg)

A constant error Δa gives Δy = (Δa/g)(1 − cos ω_s t), (8.13), which returns to
zero after every period. An error of 100 µg gives at most
{digits(by_accelerometer.largest_arcmin)}′, twice Δa/g, about as many nautical miles.

![Errors of the one-component system](images/figure_8_4.png)

Over four hours the simulation differs from (8.13) by {share(by_accelerometer.apart)} of the largest error.

## 7. What is the character of the coordinate error by a gyro?

It grows without bound, with the same oscillation upon it: Δy = Δω₀ (t − sin(ω_s t)/ω_s), (8.15). A drift of 0.01 °/h
gives {digits(by_gyro.hourly_nmi)}′, or nautical miles, per hour on the mean, and {digits(by_gyro.after_period_arcmin)}′
after one Schuler period. Over four hours the simulation differs from (8.15) by {share(by_gyro.apart)} of the
largest error.
"""


def _force() -> str:
    force = numbers.force()
    return f"""\
## 8. Which parts of the specific force must be removed, and how?

Accelerometers measure acceleration minus gravitation. To get V̇ in the local level, the computer adds gravity and takes
off the Coriolis and the transport part: V̇ = C_nb f + g − (2Ω + ω) × V. At 50° north, 9 km high and 250 m/s on a course
of 60° these are:

| part | m/s² |
|---|---|
| gravity g | {force.gravity:.4f} |
| Coriolis, 2Ω × V | {force.coriolis:.4f} |
| transport, ω × V | {force.transport:.4f} |

All follow from the computed position and velocity. Gravity comes from a model. On half an hour of this flight with a
known height, the chapter's series of order 1e-5 costs {digits(force.order_5_m)} m against the closed form. The series
of order 1e-4, which has no north component, costs {digits(force.order_4_m)} m.
"""


def _matrix() -> str:
    rate, of_earth = numbers.northward()
    return f"""\
## 9. What is the direction cosine matrix for?

It projects specific force from body axes on the axes of navigation, and the attitude angles are taken from it. An error
of the matrix projects gravity on the horizon. A parked vehicle whose initial matrix is tilted by 1′ is off by up to
{digits(numbers.tilted_nmi())} nmi within a Schuler period.

![Axes of navigation and of the body](images/frames.svg)

## 10. Which angular rates enter it?

The rate of the body in inertial space, ω_b from the gyros, and the rate of the navigation axes, ω' = Ω + ω:
Ċ = C [ω_b ×] − [ω' ×] C. Ω is the rotation of the Earth, {of_earth:.3f} °/h. The transport rate ω comes from the motion
over the Earth. A level aircraft that flies north at 1100 km/h turns by {rate:.3f} °/h about its right axis: the gyros
measure it, and ω takes it off.
"""


def _ways() -> str:
    names = {
        "euler": "Euler angles, Runge-Kutta of 4th order",
        "poisson-1": "Poisson's equation, 1st order",
        "poisson": "Poisson's equation, 4th order, fitted rate",
        "quaternion-1": "quaternion (8.18), 1st order",
        "quaternion": "quaternion (8.18), fitted rate",
        "two-quaternions": "two quaternions (8.19)",
        "rotation-vector-2": "rotation vector of two samples",
        "functional-iteration": "functional iteration",
    }
    ways = {name: numbers.way(name) for name in names}
    rows = "\n".join(
        f"| {names[name]} (`{name}`) | {small(way.error_arcsec)} | {way.operations:.0f} | {small(way.defect)} |"
        for name, way in ways.items()
    )
    loop = numbers.loop()
    return f"""\
## 11. In which ways is the matrix obtained?

From Poisson's equation of the matrix itself, from the equations of Euler angles, from a quaternion, from two
quaternions, or from rotation vectors of several samples. A minute on a cone of 1° at 1 Hz, at 100 Hz:

| algorithm | largest attitude error, ″ | operations per sample | loss of norm or orthogonality |
|---|---|---|---|
{rows}

The operations are those of attitude, velocity and position together. A rate fitted over five intervals, two of
them after the current one, is for recorded or delayed data. The step (8.19)
takes the plain increment for the rotation, so its error by coning is that of the first order.
[comparing.md](comparing.md) explains how studies compare all algorithms.

## 12. What are the advantages of quaternions?

- A quaternion has four numbers and one condition, the norm; the matrix has nine numbers and six conditions. The norm is
  restored by one root.
- It has no singular attitude. In a full turn in pitch at 100 Hz its error is {small(loop.quaternion_arcsec)}″, that of
  Euler angles {digits(loop.euler_arcsec)}″.
- It is cheap: {ways["quaternion-1"].operations:.0f} operations per sample at first order against
  {ways["poisson-1"].operations:.0f} for the matrix, at the same error, and {ways["euler"].operations:.0f} for Euler
  angles. The counts include velocity and position.
"""


def _angles() -> str:
    back = numbers.angles_back()
    return f"""\
## 13. How are the angles obtained from the matrix?

By (8.17): γ = atan2(−b₂₃, b₂₂), ϑ = arcsin b₂₁, ψ = atan2(−b₃₁, b₁₁). The heading is −ψ. The
arctangent of two arguments gives the quadrant. Over 10 000 attitudes with a pitch of up to 80° their error is
{small(back.ordinary)} rad. Within 1″ of the vertical the arcsine loses digits: the error of the pitch is
{small(back.steep)} rad, and at the vertical itself only the sum or the
difference of roll and heading is determined.
"""


def _levels() -> str:
    schedules = ((200.0, 200.0, 200.0), (200.0, 50.0, 10.0), (200.0, 20.0, 20.0), (200.0, 10.0, 10.0))
    rows = []
    for schedule in schedules:
        position, angle = numbers.levels(schedule)
        rows.append(f"| {'/'.join(f'{rate:g}' for rate in schedule)} | {digits(position)} | {digits(angle)} |")
    listed = "\n".join(rows)
    return f"""\
## 14. Into which levels of rates is the computation divided?

Fast: gyro increments, their compensation, attitude and matrix. Medium: projection of the velocity increments, Coriolis
and gravity, velocity. Slow: position, radii, Ω, ω and gravity.

![Three rates of computation](images/three_rates.svg)

Three minutes of the cruise of question 8 that also rolls by 5° at 0.2 Hz, pitches by 1° and heaves by 1 m at 0.5 Hz,
with perfect sensors, the two quaternions and a known height:

| fast/medium/slow, Hz | largest position error, m | largest attitude error, ″ |
|---|---|---|
{listed}

The error grows with the square of the medium interval, because the matrix turns while velocity increments are summed.
"""


def page() -> str:
    """Return the whole page.

    Returns:
        Markdown.
    """
    head = """\
# Fourteen questions on strapdown navigation

[Chapter 8](sources.md#chapter-8), a textbook chapter that sinssim implements, ends with control questions. Each answer
here has a number that the program computes. `python docs/questions.py` writes this page, and a test compares the page
with numbers that it computes anew.
"""
    parts = (
        head, _platform(), _advantages(), _difficulties(), _variants(), _usual(), _one_component(), _force(),
        _matrix(), _ways(), _angles(), _levels(),
    )  # fmt: skip
    return wrapped("\n".join(parts))


if __name__ == "__main__":
    FILE.write_text(page(), encoding="utf-8")
