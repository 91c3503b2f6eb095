"""Rows of docs/theory.md: formulas of the ground SINS paper and of chapter 8, the functions and the tests of each.

A function is named by its module and its name, `alignment.parked_theory.coefficients` for
`sinssim.alignment.parked_theory.coefficients`. A test is named by its file and its name below `tests/`.
"""

from __future__ import annotations

from typing import NamedTuple


class Row(NamedTuple):
    """A formula.

    Attributes:
        numbers: of its equations, as they stand in the code, for example "(7)-(10)"; "" for one without a number.
        formula: in plain text, or words for a long one.
        functions: that implement it.
        tests: that compare it with something independent.
    """

    numbers: str
    formula: str
    functions: tuple[str, ...]
    tests: tuple[str, ...]


_DETERMINATION = "alignment/test_determination.py::test_"
_THEORY = "alignment/test_theory.py::test_"
_PLANE = "strapdown/test_one_component_errors.py::test_"
_RUNS = "simulation/test_one_component.py::test_"
_AXES = "test_chapter_axes.py::test_"
_EARTH = "earth/test_earth.py::test_"
_ALGORITHMS = "strapdown/attitude/test_algorithms.py::test_"
_FRAMES = "strapdown/frames/test_frames.py::test_"
_STATISTICS = ("alignment.parked_theory.error_statistics",)

PAPER = (
    Row(
        "(1)",
        "g = √Σã², U = √Σω̃²; K from A = (ω̃_x ã_z − ω̃_z ã_x) g and B = ω̃_y (ã_x² + ã_z²) − (ω̃_x ã_x + ω̃_z ã_z) "
        "ã_y; "
        "sin γ = −ã_x/√(ã_x² + ã_z²); sin θ = ã_y/g; sin φ = ω̃·ã/(g U)",
        ("alignment.determination.solve", "alignment.determination.determine"),
        (
            _DETERMINATION + "determination_is_exact_in_every_quadrant_up_to_89_9_degrees",
            _DETERMINATION + "arctangent_forms_agree_with_the_printed_arcsines_on_any_readings",
        ),
    ),
    Row(
        "(2)",
        "ω̃_i = (1 + k_i) ω_i + ω_0i, ã_i = (1 + h_i) a_i + a_0i",
        ("alignment.parked_theory.InstrumentErrors", "sensors.imu.emulation.emulate"),
        (
            "sensors/imu/test_emulate.py::test_scale_error_is_proportional_to_the_reading",
            "sensors/imu/test_emulate.py::test_bias_is_not_scaled_and_misalignment_is",
            _THEORY + "errors_are_the_change_of_the_determination_to_first_order",
        ),
    ),
    Row(
        "(3), (4)",
        "ω = U (N cos φ + H sin φ), a = g H, with the rows N (north) and H (up) of the body axes",
        ("alignment.parked_theory.ideal_readings",),
        (
            _DETERMINATION + "ideal_readings_are_the_printed_equations",
            _DETERMINATION + "ideal_rate_in_attitudes_that_need_no_formula",
        ),
    ),
    Row(
        "",
        "(5) Perfect instruments: (1) gives the true K, γ, θ, φ; (6) ΔK = K̃ − K, and so on",
        ("alignment.determination.determine",),
        (_DETERMINATION + "determination_is_exact_in_every_quadrant_up_to_89_9_degrees",),
    ),
    Row(
        "(7)",
        "ΔK = Σ m_i δω_i + Σ n_i δa_i; m_i = −E_i/(U cos φ); n_i = (E_i tan φ − tilt_i)/g, tilt = (cos γ tan θ, 0, "
        "sin γ tan θ)",
        ("alignment.parked_theory.coefficients", "alignment.parked_theory.errors"),
        (_THEORY + "coefficients_are_the_derivatives_of_the_determination", _THEORY + "signs_and_orders_of_magnitude"),
    ),
    Row(
        "(8)",
        "Δγ = q_x δa_x + q_z δa_z; q_x = −cos γ/(g cos θ), q_z = −sin γ/(g cos θ)",
        ("alignment.parked_theory.coefficients", "alignment.parked_theory.errors"),
        (_THEORY + "coefficients_are_the_derivatives_of_the_determination",),
    ),
    Row(
        "(9)",
        "Δθ = Σ l_i δa_i; l = (sin γ sin θ, cos θ, −cos γ sin θ)/g",
        ("alignment.parked_theory.coefficients", "alignment.parked_theory.errors"),
        (_THEORY + "coefficients_are_the_derivatives_of_the_determination",),
    ),
    Row(
        "(10)",
        "Δφ = Σ p_i δω_i + Σ r_i δa_i; p_i = (cos φ H_i − sin φ N_i)/U, r_i = N_i/g",
        ("alignment.parked_theory.coefficients", "alignment.parked_theory.errors"),
        (_THEORY + "coefficients_are_the_derivatives_of_the_determination",),
    ),
    Row(
        "(11), (12)",
        "Mean and variance of ΔK in the general case: sums of (7) with the means, and of the squared terms with the "
        "variances",
        _STATISTICS,
        (
            _THEORY + "11_12_heading_and_22_23_latitude_in_general",
            _THEORY + "many_draws_through_the_determination_have_the_predicted_moments",
        ),
    ),
    Row(
        "(13)-(15)",
        "Heading of a level vehicle: mean, variance, and variance with identical instruments, "
        "σ²{ΔK} = (σ{ω₀}/(U cos φ))² + ½ σ²{k} sin² 2K + (σ{a₀} tan φ/g)²",
        _STATISTICS,
        (
            _THEORY + "13_mean_heading_level",
            _THEORY + "14_variance_heading_level",
            _THEORY + "15_variance_heading_level_identical_instruments",
        ),
    ),
    Row(
        "(16)-(18)",
        "Roll: mean, variance, and σ²{Δγ} = (σ{a₀}/(g cos θ))² + ½ σ²{h} sin² 2γ",
        _STATISTICS,
        (
            _THEORY + "16_mean_roll",
            _THEORY + "17_variance_roll",
            _THEORY + "18_variance_roll_identical_instruments",
        ),
    ),
    Row(
        "(19)-(21)",
        "Pitch: mean, variance, and σ²{Δθ} = (σ{a₀}/g)² + ¼ σ²{h} (1 + sin⁴ γ + cos⁴ γ) sin² 2θ",
        _STATISTICS,
        (
            _THEORY + "19_mean_pitch",
            _THEORY + "20_variance_pitch",
            _THEORY + "21_variance_pitch_identical_instruments",
        ),
    ),
    Row(
        "(22), (23)",
        "Mean and variance of Δφ in the general case: sums of (10)",
        _STATISTICS,
        (_THEORY + "11_12_heading_and_22_23_latitude_in_general",),
    ),
    Row(
        "(24)-(26)",
        "Latitude of a level vehicle: mean, variance, and "
        "σ²{Δφ} = (σ{ω₀}/U)² + ¼ σ²{k} (1 + sin⁴ K + cos⁴ K) sin² 2φ + (σ{a₀}/g)²",
        _STATISTICS,
        (
            _THEORY + "24_mean_latitude_level",
            _THEORY + "25_variance_latitude_level",
            _THEORY + "26_variance_latitude_level_identical_instruments",
        ),
    ),
)
"""The ground SINS paper, in the order of its equations."""

CHAPTER = (
    Row(
        "",
        "§ 8.1: a_ξ = a_x cos α − a_y sin α, a_η = a_x sin α + a_y cos α; V̇ = a_ξ, ẏ = V/R, α̇ = ω + V/R",
        ("strapdown.one_component_system.projections", "strapdown.one_component_system.simulate"),
        (
            _PLANE + "projections_undo_the_pitch",
            "strapdown/test_one_component.py::test_perfect_instruments_on_a_flight_second_order",
        ),
    ),
    Row(
        "",
        "§ 8.1: pitch measured directly, α = measured inertial angle + y",
        ("strapdown.one_component_system.simulate_measured",),
        (_PLANE + "measured_pitch_swings_as_8_13_and_8_15",),
    ),
    Row(
        "",
        "§ 8.1: pitch from two integrals of ω̇ (accelerometers on an arm)",
        ("strapdown.one_component_system.simulate_two_integrals",),
        (_PLANE + "two_integrals_grow_with_the_square_of_time",),
    ),
    Row(
        "",
        "§ 8.1: ω_s² = g/R, a period of 84.4 min",
        ("strapdown.one_component_system.schuler_rate",),
        ("strapdown/test_one_component.py::test_schuler_period_is_84_4_minutes",),
    ),
    Row(
        "(8.10)",
        "Δα̇ = Δω + ΔV/R, ΔV̇ = Δa_x cos α − Δa_y sin α − a_η Δα",
        ("strapdown.one_component_system.error_along_motion",),
        (_PLANE + "equations_8_10_and_8_11_along_a_motion", _RUNS + "simulation_obeys_8_11_along_a_motion"),
    ),
    Row(
        "(8.11)",
        "Δÿ + (a_η/R) Δy = (Δa_x cos α − Δa_y sin α)/R − (a_η/R) Δα_g, Δα_g = ∫ Δω dt",
        ("strapdown.one_component_system.error_pendulum",),
        (_PLANE + "equations_8_10_and_8_11_along_a_motion", _RUNS + "simulation_obeys_8_11_along_a_motion"),
    ),
    Row(
        "(8.12)",
        "Δÿ + (g/R) Δy = (Δa_x − α Δa_y)/R − (g/R) Δα_g; with Δa_x = Δa_y = Δa the right side is Δa (1 − α)/R − …",
        ("strapdown.one_component_system.error_first_order",),
        (
            _PLANE + "equation_8_12_is_first_order_in_the_pitch",
            _PLANE + "equal_accelerometer_errors_act_as_one_less_the_pitch",
        ),
    ),
    Row(
        "(8.13)",
        "Constant accelerometer error: Δy = (Δa/g) (1 − cos ω_s t), at most 2 Δa/g",
        ("strapdown.one_component_system.accelerometer_error", "strapdown.one_component_system.closed_form"),
        (
            "strapdown/test_one_component.py::test_accelerometer_error_8_13",
            _PLANE + "closed_form_of_each_constant_error",
        ),
    ),
    Row(
        "(8.14)",
        "Δÿ + ω_s² Δy = ω_s² Δα(t)",
        ("strapdown.one_component_system.simulate", "strapdown.measured_attitude.navigate_by_attitude"),
        (
            "strapdown/test_one_component.py::test_error_equations_8_12_and_8_14_for_errors_that_vary",
            "strapdown/test_measured_attitude.py::test_attitude_bias_and_drift_8_14_8_15",
        ),
    ),
    Row(
        "(8.15)",
        "Constant gyro error: Δy = Δω₀ (t − sin(ω_s t)/ω_s)",
        ("strapdown.one_component_system.gyro_error", "strapdown.one_component_system.closed_form"),
        (
            "strapdown/test_one_component.py::test_gyro_error_8_15",
            "strapdown/test_measured_attitude.py::test_attitude_bias_and_drift_8_14_8_15",
        ),
    ),
    Row(
        "",
        "§ 8.1: six accelerometers, A = s·f + (r × s)·ω̇ + s·(ω × (ω × r)), and the growth of their position error",
        ("sensors.single_sensors.gyro_free_increments", "sensors.single_sensors.position_error"),
        (
            "sensors/sets/test_gyro_free.py::test_ideal_accelerometers_give_the_ideal_increments",
            "sensors/sets/test_gyro_free.py::test_error_grows_by_the_law",
        ),
    ),
    Row(
        "",
        "§ 8.2: compensation, the inverse of the sensors' model with imperfect calibration values",
        ("sensors.imu.compensation.compensate",),
        (
            "sensors/imu/test_compensation.py::test_perfect_calibration_restores_the_ideal_increments",
            "sensors/imu/test_compensation.py::test_non_linearity_is_undone_as_the_roots_of_its_cubic_say",
        ),
    ),
    Row(
        "",
        "§ 8.2: Ḃ = V_N/(R₁+H), L̇ = V_E/((R₂+H) cos B), Ḣ = V_H; R₁ = a(1−e²)/(1−e² sin² B)^{3/2}, "
        "R₂ = a/(1−e² sin² B)^{1/2}",
        ("earth.geodetic_coordinates.radii", "strapdown.frames.level.solve"),
        (_EARTH + "radii_are_the_curvature_of_the_ellipse", _FRAMES + "all_frames_meet_the_truth"),
    ),
    Row(
        "(8.16)",
        "1/(R₁+H) ≈ (1/a)[1 + e²(1 − 3/2 sin² B) − H/a], 1/(R₂+H) ≈ (1/a)[1 − ½e² sin² B − H/a]; further forms "
        "neglect e² or H",
        ("strapdown.frames.navigation_problem.curvatures_k",),
        (
            "strapdown/test_s_turn.py::test_simplified_curvature_costs_what_8_16_neglects",
            "strapdown/frames/test_radii.py::test_a_flight_to_the_north",
        ),
    ),
    Row(
        "",
        "§ 8.2: V̇ = a + g − (2Ω + ω) × V with Ω = ω_з (cos B, sin B, 0), ω = (V_E/(R₂+H), V_E tan B/(R₂+H), "
        "−V_N/(R₁+H)) on N, H, E",
        ("strapdown.frames.level.solve", "strapdown.navigate.navigate"),
        (
            _AXES + "rates_and_dynamics_of_the_chapter",
            "strapdown/test_s_turn.py::test_order_of_convergence",
        ),
    ),
    Row(
        "",
        "§ 8.2: gravity to the orders 1e-5, 1e-4 and 1e-2, with g_e, q and β = 5q/2 − e²/2",
        ("earth.gravity.gravity_ned",),
        (
            _EARTH + "chapter_formulas_with_their_own_constants",
            _EARTH + "orders_of_the_chapters_series_to_100_km",
        ),
    ),
    Row(
        "",
        "§ 8.2: frames of other azimuth, the inertial frame and the orthodromic (transverse) frame",
        (
            "strapdown.frames.wander_free_transverse.solve",
            "strapdown.frames.inertial.solve",
            "strapdown.frames.route_pole.route_pole",
        ),
        (_FRAMES + "all_frames_meet_the_truth", _FRAMES + "over_the_pole"),
    ),
    Row(
        "(8.17)",
        "γ = atan2(−b₂₃, b₂₂), ϑ = arcsin b₂₁, ψ = atan2(−b₃₁, b₁₁)",
        ("rotation.quaternions.euler_from_quaternion",),
        (_AXES + "angles_of_eq_8_17", "rotation/test_rotation.py::test_euler_angles_are_scipys_zyx"),
    ),
    Row(
        "",
        "§ 8.2: Poisson's equation Ḃ = B[ω_b×] − [ω'×]B, steps of first to fourth order",
        ("strapdown.attitude.poisson.step_k",),
        (_ALGORITHMS + "constant_rate_error_of_a_step", _ALGORITHMS + "order_of_convergence"),
    ),
    Row(
        "",
        "§ 8.2: ψ̇ = (ω_y cos γ − ω_z sin γ)/cos ϑ, ϑ̇ = ω_y sin γ + ω_z cos γ, γ̇ = ω_x − tan ϑ (ω_y cos γ − ω_z sin γ)",
        ("strapdown.attitude.euler.step_k",),
        (
            _AXES + "euler_rates_of_the_chapter",
            "strapdown/attitude/test_euler_singularity.py::test_the_nearer_the_worse",
        ),
    ),
    Row(
        "(8.18)",
        "λ̇ = ½ Ω(ω) λ with the rate relative to the navigation frame",
        ("strapdown.attitude.quaternion.step_k", "strapdown.attitude.quaternion_picard.step_k"),
        (_ALGORITHMS + "exact_steps", _ALGORITHMS + "constant_rate_error_of_a_step"),
    ),
    Row(
        "(8.19)",
        "λ₀' = (1 − e²/8) λ₀ − ½ Δβ·λ, and the other three; body to inertial by Δβ, navigation to inertial by ∫ω'dt",
        ("strapdown.attitude.two_quaternions.picard_step_k", "strapdown.attitude.two_quaternions.step_k"),
        (
            _AXES + "quaternion_step_of_eq_8_19_is_a_product_on_the_right",
            _ALGORITHMS + "two_quaternions_in_the_chapters_axes",
        ),
    ),
    Row(
        "(8.20)-(8.28)",
        "Three rates: attitude at the fast rate, velocity at the medium rate, position, radii, Ω, ω and gravity at "
        "the slow rate, held or extrapolated",
        ("strapdown.frames.three_rate_schedule.three_rate_engines", "strapdown.frames.level.solve_three_rates"),
        (
            "strapdown/frames/test_three_rates.py::test_second_order_in_the_medium_interval",
            "strapdown/frames/test_three_rates.py::test_order_in_the_slow_interval",
        ),
    ),
)
"""Chapter 8, in its order."""
