"""Writes the answers of docs/questions.md with computed numbers for the site: `python docs/questions.py`."""

from __future__ import annotations

import math
import sys
import textwrap
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import question_numbers as numbers

FILE = Path(__file__).parents[1] / "build" / "questions.md"

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

The computer replaces the platform. The gyros measure the angular rate of the body, and the attitude algorithm
integrates it to the direction cosine matrix C_nb. This matrix is an analytic platform: it transforms the measured
specific force from body axes to navigation axes.

![A computed platform: sensors, compensation, attitude, velocity and position](images/strapdown_scheme.svg)

On a turntable that turns ten times about the forward axis at 300 °/s, with perfect sensors at 200 Hz, the computed
platform remains level: its error in {roll.seconds:.0f} s is {small(roll.perfect_arcsec)}″.
"""


def _advantages() -> str:
    loop, redundancy = numbers.loop(), numbers.redundancy()
    return f"""\
## 2. What are the advantages of strapdown systems?

- No mechanics: strapdown systems have no gimbals, bearings, slip rings or torquers. They are therefore smaller,
  lighter, cheaper and more reliable, and their start-up time is shorter.
- All attitudes: in a full turn in pitch, which would cause gimbal lock on a platform with three gimbals, the attitude
  error of the quaternion algorithm at 100 Hz is {small(loop.quaternion_arcsec)}″. Euler angles correspond to gimbals:
  in the same turn their error is {digits(loop.euler_arcsec)}″.
- Redundancy and monitoring: sensors can be added on any axis, because each is only a direction in the body. Six gyros
  along the normals of a dodecahedron measure each axis with {redundancy.all_six:.3f} of the noise of one gyro. A
  fault can be isolated while five of them are left: {redundancy.isolable_after} faults in turn are survived, and the
  four that remain measure an axis with at most {redundancy.four:.2f} of that noise. A platform needs a second platform.
- Rates of the body: the same sensors give the angular rate and the specific force of the body for the flight control
  system, at the sampling rate. From a platform they must be differentiated: angles of gimbals with a noise of 20″, read
  at 200 Hz, give rates with a noise of {20.0 * math.sqrt(2.0) * 200.0 / 3600.0:.2f} °/s.
"""


def _difficulties() -> str:
    roll, exposure = numbers.roll(), numbers.exposure()
    rows = "\n".join(f"| {rate:g} | {digits(numbers.coning(rate))} |" for rate in (10.0, 20.0, 50.0, 100.0, 200.0))
    operations = numbers.way("quaternion").operations
    return f"""\
## 3. What are the difficulties of strapdown systems?

The sensors are exposed to the full motion of the body. A gyro must measure 300 °/s and must not drift by more than
0.01 °/h, a ratio of {300.0 * 3600.0 / 0.01 / 1e6:.0f} million. Its scale-factor error acts on every turn: an error of
10 ppm causes {digits(roll.scaled_arcsec)}″ in ten turns; 10⁻⁵ · 3600° is 129.6″. On a platform, which turns by the
Earth's rate only, the same error causes {digits(exposure.platform_arcsec)}″ in the same time. A gyro whose axis is
misaligned by 5″ causes up to {digits(exposure.misaligned_arcsec)}″ in the same rolls, twice the misalignment at each
half turn. Errors must therefore be calibrated and compensated, and stay stable from one calibration to the next.

The attitude algorithm must follow fast motion and vibration. On a cone of 1° at 1 Hz the first-order quaternion step
has these errors after one minute:

| sampling rate, Hz | attitude error, ″ |
|---|---|
{rows}

The computer must do all that the gimbals do: at 200 Hz the quaternion algorithm with velocity and position takes
{operations * 200.0 / 1e6:.2f} million operations per second.

The sensors cannot be turned at will, so that the alignment is computed and not levelled, and gyro biases remain in it:
0.01 °/h of the east gyro leaves b/(Ω cos B) = {digits(numbers.azimuth_arcmin())}′ of azimuth at 50°. A platform can
turn to calibrate its gyros; a strapdown system needs an [IMU that is rotated](rotating-units.md).
"""


def _variants() -> str:
    times = (10.0, 60.0, 120.0)
    sets = numbers.variants(times)
    names = {
        "accelerometers": "six accelerometers of 1 µg (1σ), arms of 1 m",
        "gyros": "three accelerometers, three rate gyros of 0.01 °/h",
        "attitude": "three accelerometers, an attitude sensor with an error of 10″",
    }
    rows = "\n".join(f"| {names[name]} | " + " | ".join(digits(float(v)) for v in sets[name]) + " |" for name in names)
    return f"""\
## 4. Which variants of strapdown systems exist?

Three sets of sensors determine the attitude in three ways: by two integrations of the angular acceleration of six
accelerometers, by one integration of the rate of gyros, or by a direct measurement. The table gives the position error
of a level system at rest, in m:

| sensors | 10 s | 1 min | 2 min |
|---|---|---|---|
{rows}

The error of the first set initially grows with the fourth power of time, that of the second set with the third power,
and that of the third set with the square. `sinssim compare sensor_sets` simulates all three sets.
"""


def _usual() -> str:
    expectation = numbers.airliner()
    first = next(c for c in expectation.contributions if "gyro bias" in c.term)
    return f"""\
## 5. Which variant is usual in manned aircraft?

Manned aircraft usually have three rate gyros and three accelerometers at one place near the centre of mass, and
navigate in the local-level frame. Laser gyros with 0.01 °/h and accelerometers with 50 µg (the grade `laser-standard`)
cause a position error of {digits(expectation.total / 1852.0)} nmi (1σ) after one hour. The bias of one level gyro alone
causes {digits(first.position / 1852.0)} nmi. `sinssim sensors laser-standard` lists all contributions.
"""


def _one_component() -> str:
    by_accelerometer, by_gyro = numbers.pendulum(True), numbers.pendulum(False)
    return f"""\
## 6. How does the position error due to an accelerometer error develop?

The position error oscillates and remains bounded. The one-component system shows this. It consists of two
accelerometers and a gyro in a vertical plane, and its coordinate y is the angular distance along the Earth.

![Axes of the one-component system](images/one_component_axes.svg)

![Block diagram of the one-component system](images/one_component_scheme.svg)

An error of the coordinate tilts the computed horizon, and the tilt adds a component of gravity that acts against the
error. This loop behaves as a pendulum with the Schuler period, {digits(by_accelerometer.period_min)} min.

![Error loop](images/schuler_loop.svg)

A constant error Δa causes Δy = (Δa/g)(1 − cos ω_s t), eq. (8.13), which returns to zero after every period. An error of
100 µg causes at most {digits(by_accelerometer.largest_arcmin)}′, which is twice Δa/g. One arcminute corresponds to
about one nautical mile.

![Errors of the one-component system](images/figure_8_4.png)

Over four hours the simulation differs from (8.13) by {share(by_accelerometer.apart)} of the largest error.

## 7. How does the position error due to a gyro error develop?

The position error grows without bound, with the same oscillation superimposed: Δy = Δω₀ (t − sin(ω_s t)/ω_s), eq.
(8.15). A drift of 0.01 °/h causes {digits(by_gyro.hourly_nmi)}′, or nautical miles, per hour on average, and
{digits(by_gyro.after_period_arcmin)}′ after one Schuler period. Over four hours the simulation differs from (8.15) by
{share(by_gyro.apart)} of the largest error.
"""


def _force() -> str:
    force = numbers.force()
    return f"""\
## 8. Which parts of the specific force must be removed, and how?

Accelerometers measure acceleration minus gravitation. To obtain V̇ in the local-level frame, the computer adds gravity
and
subtracts the Coriolis and the transport acceleration: V̇ = C_nb f + g − (2Ω + ω) × V. At 50° north, at a height of 9 km
and at 250 m/s on a course of 60°, these terms are:

| term | m/s² |
|---|---|
| gravity g | {force.gravity:.4f} |
| Coriolis, 2Ω × V | {force.coriolis:.4f} |
| transport, ω × V | {force.transport:.4f} |

All terms follow from the computed position and velocity; gravity is computed from a model. In half an hour of this
flight with a known height, the series of order 1e-5 in the chapter causes an error of {digits(force.order_5_m)} m
relative to the closed form. The series of order 1e-4, which has no north component, causes {digits(force.order_4_m)} m.
"""


def _matrix() -> str:
    rate, of_earth = numbers.northward()
    return f"""\
## 9. What is the purpose of the direction cosine matrix?

The direction cosine matrix transforms the specific force from body axes to navigation axes, and it gives the attitude
angles. An error of the matrix causes a horizontal component of gravity. If the initial matrix of a parked vehicle is
tilted by 1′, the position error reaches {digits(numbers.tilted_nmi())} nmi within one Schuler period.

![Navigation axes and body axes](images/frames.svg)

## 10. Which angular rates determine the direction cosine matrix?

Two rates determine the matrix: the inertial rate of the body, ω_b from the gyros, and the rate of the navigation axes,
ω' = Ω + ω. The equation is Ċ = C [ω_b ×] − [ω' ×] C. Ω is the Earth's rate, {of_earth:.3f} °/h. The transport rate ω is
caused by the motion over the Earth. A level aircraft that flies north at 1100 km/h rotates at {rate:.3f} °/h about its
right axis. The gyros measure this rotation, and ω compensates it.
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
    loop, steps, matrices = numbers.loop(), numbers.steps(), numbers.matrices()
    return f"""\
## 11. How can the direction cosine matrix be computed?

The matrix can be computed from Poisson's equation for the matrix, from the equations of Euler angles, from a
quaternion, from two quaternions, or from rotation vectors of several samples. The table gives results for one minute on
a cone of 1° at 1 Hz, with samples at 100 Hz:

| algorithm | largest attitude error, ″ | operations per sample | loss of norm or orthogonality |
|---|---|---|---|
{rows}

The operations are those of attitude, velocity and position together. A rate that is fitted over five intervals, two of
them after the current one, is suitable for recorded or delayed data. The step (8.19) uses the increment as the rotation
vector without coning compensation, so its coning error is of first order. [comparing.md](comparing.md) explains how
studies compare all algorithms.

## 12. What are the advantages of quaternions?

- A quaternion has four elements and one constraint, the norm; the matrix has nine elements and six constraints. One
  square root restores the norm.
- The axes remain orthogonal: B from a quaternion of any norm has orthogonal axes, to rounding. Poisson's
  equation of first order loses {digits(steps.matrix_skew)} of orthogonality in ten rolls at 300 °/s, sampled at
  100 Hz.
- A step is more accurate, because it takes half the angle: in these rolls the second order is off by
  {digits(steps.quaternion_arcsec)}″, the matrix by {digits(steps.matrix_arcsec)}″,
  {steps.matrix_arcsec / steps.quaternion_arcsec:.2f} times as much. By theory, φ³/6 over φ³/24 per step is 4.
- A quaternion has no singular attitude. In a full turn in pitch at 100 Hz its error is
  {small(loop.quaternion_arcsec)}″, and that of Euler angles is {digits(loop.euler_arcsec)}″.
- A quaternion needs few operations: {ways["quaternion-1"].operations:.0f} per sample at first order, compared with
  {ways["poisson-1"].operations:.0f} for the matrix, and {ways["euler"].operations:.0f} for Euler angles. The counts
  include velocity and position. Attitude and B alone, with fitted rates, take {matrices.quaternion:.0f},
  {matrices.poisson:.0f} and {matrices.euler:.0f}.
- B needs no trigonometric functions: it takes {matrices.by_products:.0f} operations from a quaternion and
  {matrices.by_functions:.0f} from three angles, because a sine is a polynomial of 24 operations.
"""


def _angles() -> str:
    back = numbers.angles_back()
    return f"""\
## 13. How are the attitude angles computed from the matrix?

The angles follow from eq. (8.17): γ = atan2(−b₂₃, b₂₂), ϑ = arcsin b₂₁, ψ = atan2(−b₃₁, b₁₁). The heading is −ψ. The
arctangent of two arguments gives the correct quadrant. Over 10 000 attitudes with a pitch of up to 80°, the error of
the angles is {small(back.ordinary)} rad. Within 1″ of the vertical the arcsine loses digits, and the error of the pitch
is {small(back.steep)} rad. At the vertical, only the sum or the difference of roll and heading is determined.
"""


def _levels() -> str:
    schedules = ((200.0, 200.0, 200.0), (200.0, 50.0, 10.0), (200.0, 20.0, 20.0), (200.0, 10.0, 10.0))
    rows = []
    for schedule in schedules:
        position, angle = numbers.levels(schedule)
        rows.append(f"| {'/'.join(f'{rate:g}' for rate in schedule)} | {digits(position)} | {digits(angle)} |")
    listed = "\n".join(rows)
    return f"""\
## 14. How is the computation divided among different rates?

The fast part processes the gyro increments, their compensation, the attitude and the matrix. The medium part processes
the transformation of the velocity increments, the Coriolis acceleration, gravity and the velocity. The slow part
processes the position, the radii, Ω, ω and the gravity model.

![Three rates of computation](images/three_rates.svg)

The table gives results for three minutes of the cruise of question 8. The aircraft also rolls by 5° at 0.2 Hz, pitches
by 1° and heaves by 1 m at 0.5 Hz. The sensors are perfect, the algorithm has two quaternions, and the height is known.

| fast/medium/slow, Hz | largest position error, m | largest attitude error, ″ |
|---|---|---|
{listed}

The error grows with the square of the medium interval, because the matrix rotates while velocity increments are summed.
"""


def answers() -> str:
    """Return the answers as Markdown."""
    parts = (
        _platform(), _advantages(), _difficulties(), _variants(), _usual(), _one_component(), _force(),
        _matrix(), _ways(), _angles(), _levels(),
    )  # fmt: skip
    return wrapped("\n".join(parts))


if __name__ == "__main__":
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(answers(), encoding="utf-8")
