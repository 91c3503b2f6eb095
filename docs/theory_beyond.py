"""Rows of docs/theory.md beyond the ground SINS paper and chapter 8; see docs/theory_rows.py."""

from __future__ import annotations

from theory_rows import Row

_EARTH = "earth/test_earth.py::test_"
_ALGORITHMS = "strapdown/attitude/test_algorithms.py::test_"

BEYOND = (
    Row(
        "",
        "Normal gravity at any height, both components, closed form in ellipsoidal harmonics (Heiskanen and Moritz)",
        ("earth.gravity.gravity_ned",),
        (_EARTH + "normal_gravity_is_the_zonal_series", _EARTH + "normal_gravity_at_the_surface_is_somiglianas"),
    ),
    Row(
        "",
        "J2 gravity, the gradient of its potential",
        ("earth.gravity.gravitation_ecef",),
        (_EARTH + "j2_gravity_is_the_gradient_of_its_potential", _EARTH + "j2_gravity_is_jsbsims"),
    ),
    Row(
        "",
        "Increments of truth: Gauss-Legendre integrals of angular rate and specific force of a quintic spline",
        ("truth.curve.Curve",),
        (
            "truth/test_curve.py::test_increments_against_adaptive_quadrature",
            "truth/test_independent_integration.py::test_smooth_flight_of_ten_minutes",
        ),
    ),
    Row(
        "",
        "Rotation-vector update of 1 to 4 samples; drift under coning −α²Ω L xⁿ⁺ⁿ, L = n!/(2ⁿ⁺¹ (2n+1)!!)",
        ("strapdown.attitude.rotation_vector.turn_k", "strapdown.attitude.rotation_vector.drift_under_coning"),
        (_ALGORITHMS + "coning_coefficients", _ALGORITHMS + "coning_drift_is_the_exact_one"),
    ),
    Row(
        "",
        "Functional iteration: Chebyshev fit of the increments, attitude, velocity and position iterated together",
        ("strapdown.attitude.functional_iteration.solve_level", "strapdown.navigate.navigate"),
        (_ALGORITHMS + "functional_iteration_of_the_attitude", _ALGORITHMS + "order_of_convergence"),
    ),
    Row(
        "",
        "Baro loop of third order: k₁ = 3/τ, k₂ = 3/τ² + 2g/R, k₃ = 1/τ³",
        ("strapdown.frames.vertical_channel.loop_gains_k", "strapdown.navigate.navigate"),
        ("strapdown/frames/test_vertical.py::test_baro_loop_answers_with_its_triple_pole",),
    ),
    Row(
        "",
        "Position error at rest: v sin ωt/ω, ε R (1 − cos ωt), ζ R U cos φ (t − sin ωt/ω)",
        ("sensors.error_propagation.Schuler",),
        ("sensors/test_error_propagation.py::test_noise_is_the_sum_of_the_navigators_own_impulses",),
    ),
    Row(
        "",
        "Laser gyro: ψ̇ = K (Ω + Ω_d) − K Ω_L sin ψ; random walk N = Ω_L/√(K Ω_D); dead zone Ω_L J₀(KΘ)",
        ("sensors.imu.laser_gyro.LaserGyro",),
        (
            "sensors/imu/test_ring.py::test_random_walk_worked_out_by_hand",
            "sensors/imu/test_ring.py::test_undithered_phase_is_adlers_solution",
        ),
    ),
    Row(
        "",
        "First-order Gauss-Markov process, sampled and averaged exactly",
        ("statistics.random_numbers.gauss_markov",),
        ("statistics/test_gauss_markov.py::test_process_has_its_covariance_at_any_instants",),
    ),
    Row(
        "",
        "Allan variance of each noise term, and its degrees of freedom",
        (
            "analyses.allan_deviation.allan_deviation",
            "analyses.allan_deviation.degrees_of_freedom",
        ),
        (
            "analyses/noise/test_allan.py::test_allan_variance_is_the_integral_over_the_spectrum",
            "analyses/noise/test_allan.py::test_degrees_of_freedom_against_published_approximations",
        ),
    ),
    Row(
        "",
        "Redundant sensors: x̂ = (HᵀWH)⁻¹HᵀWy, tr (HᵀH)⁻¹ ≥ 9/m; parity p = V y, V H = 0, V Vᵀ = I",
        ("sensors.sensor_set_section.estimator", "sensors.sensor_set_section.parity_matrix"),
        (
            "sensors/sets/test_geometry.py::test_parity_has_its_defining_properties",
            "sensors/sets/test_geometry.py::test_ready_sets_reach_the_bound",
        ),
    ),
    Row(
        "",
        "Two systems compared: s = dᵀ(2C)⁻¹d against χ²; after a fault non-central with λ = eᵀ(2C)⁻¹e",
        ("statistics.chi_square.compare_systems", "statistics.chi_square.detection_probability"),
        (
            "statistics/test_systems.py::test_false_alarms_are_as_frequent_as_stated",
            "statistics/test_systems.py::test_detection_time_is_the_predicted_one",
        ),
    ),
    Row(
        "",
        "Instantaneous rates, integrated by trapezoids, under coning: d' = κ² (½ a²Ω + d) − ½ a²Ω, κ = x/tan x, "
        "x = ΩT/2; rounding of rates: a random walk Q/√(12 T)",
        ("sensors.imu.emulation.measured_increments", "experiments.run.run_execution.run"),
        (
            "sensors/test_rates.py::test_instantaneous_rates_under_coning",
            "sensors/test_rates.py::test_filter_assumes_the_rounding_as_white_noise",
        ),
    ),
    Row(
        "",
        "Errors of the combination: bias G b, matrix Σ g_i (k_i h_i + Σ M_ij a_ij)ᵀ, covariance σ² P, P = G Gᵀ; change "
        "of the bias at an exclusion: σ² (P′ − P)",
        ("sensors.redundant_set_errors.combined_errors", "scenario.filter_model.noise_of_combination"),
        (
            "sensors/sets/test_combination.py::test_combination_has_the_errors_of_the_triad",
            "scenario/test_redundant_set.py::test_filter_is_consistent",
        ),
    ),
    Row(
        "",
        "Detection: pᵀp/σ² against χ² with m − 3 degrees of freedom",
        ("sensors.fault_detection.threshold", "sensors.fault_detection.missed_detection"),
        (
            "sensors/sets/test_detection.py::test_thresholds_of_the_published_table",
            "sensors/sets/test_monitor.py::test_false_alarms_are_as_frequent_as_stated",
        ),
    ),
    Row(
        "",
        "Error dynamics: φ̇ = −ω_in × φ + δω_ie + δω_en − C_nb δω; δv̇ = f × φ + C_nb δf − (2ω_ie + ω_en) × δv + "
        "v × (2δω_ie + δω_en) + δg",
        ("estimation.error_dynamics.dynamics", "estimation.error_dynamics.transition"),
        (
            "estimation/test_dynamics.py::test_f_is_the_engines",
            "estimation/test_dynamics.py::test_phi_and_q_are_van_loans",
        ),
    ),
    Row(
        "",
        "Kalman filter: prediction, update, gate on the normalised innovation squared",
        ("estimation.kalman_filter.ErrorFilter",),
        ("estimation/test_kalman.py::test_predict_and_update_are_the_textbooks",),
    ),
    Row(
        "",
        "Rauch-Tung-Striebel smoother",
        ("estimation.smoother.smooth",),
        ("estimation/test_smoother.py::test_open_loop_is_filterpys_and_closed_loop_the_same",),
    ),
    Row(
        "",
        "Covariance of the errors by source, and the largest value of a source that meets a requirement",
        ("analyses.error_budget.source_propagation.Propagation", "analyses.error_budget.budget_result.answers"),
        (
            "analyses/error_budget/test_closed_forms.py::test_one_source_at_rest",
            "analyses/error_budget/test_limits.py::test_the_largest_values_just_meet_the_requirement",
        ),
    ),
    Row(
        "",
        "Platform: ψ̇_i = C_ip (κ ω_commanded − d)",
        ("strapdown.platform_theory.errors_by_cause", "strapdown.gimballed_platform.navigate_platform"),
        ("strapdown/test_navigate.py::test_one_error_alone_is_that_of_the_error_equations",),
    ),
    Row(
        "",
        "Alignment of a platform: (s + 1/τ)³ and s² + 2ζω₀s + ω₀²; final tilts ∇/g, azimuth d_E/Ω_N − tan φ ∇_E/g; "
        "noise N √(3/(16 τ))/Ω_N",
        ("strapdown.platform_theory.AlignmentLoops",),
        (
            "strapdown/test_alignment.py::test_poles_are_the_designed_ones",
            "strapdown/test_alignment.py::test_final_errors",
            "strapdown/test_alignment.py::test_the_loop_with_large_angles_ends_as_the_linear_one",
            "strapdown/test_alignment.py::test_covariance_ends_at_the_final_errors_and_the_noise",
        ),
    ),
    Row(
        "",
        "Radius of the circle that contains a given fraction of a bivariate normal distribution (Hoyt)",
        ("statistics.circular_error.circle_radius",),
        ("statistics/test_circles.py::test_against_marcum_q",),
    ),
    Row(
        "",
        "Percentile of random runs with its confidence interval from order statistics",
        ("statistics.percentiles.percentile",),
        ("statistics/test_order_statistics.py::test_textbook_bands",),
    ),
    Row(
        "",
        "Gravity of a spherical-harmonic model, synthesised to degree and order n",
        ("earth.gravity_disturbance.harmonic_k", "earth.gravity_disturbance.harmonic_rows"),
        ("earth/test_synthesis.py::test_the_gradient_is_that_of_the_potential",),
    ),
)
"""What sinssim adds, of which each page explains its own part."""
